#include "host/compound/label_code.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <initializer_list>
#include <limits>
#include <utility>

#include "btfield/error.hpp"
#include "host/base/text.hpp"

namespace btfield::detail {
namespace {

using std::size_t;

// Probabilities are in units of 2^-16, their logits (ln p/(1 - p)) in units of 2^-8, weights in units of
// 2^-16. Mixing: Mahoney, "Adaptive weighing of context models for lossless data compression", 2005.

constexpr int one = 65536;
constexpr int largest_logit = 2047;
constexpr size_t context_models = 7;
constexpr int least_table_bits = 10, most_table_bits = 16;
constexpr size_t mixer_sets = 8;
constexpr int most_known = 255;  ///< decisions after which a probability adapts no more slowly
constexpr int first_weight = one * 2 / 5, largest_weight = one * 16;
constexpr int learning_shift = 15;
constexpr int most_steps_told_apart = 7;
constexpr size_t decisions = 3 + 2 * most_steps_told_apart;
/// Below what a code can hold in one byte: no decision is more certain than the largest logit.
constexpr size_t most_pixels_per_byte = size_t{1} << 15;
constexpr size_t checksum_bytes = 4;

constexpr int probability_of_logit(int logit) {
    constexpr std::array<int, 33> table{22,    36,    60,    98,    162,   267,   439,   720,   1179,
                                        1921,  3108,  4971,  7812,  11955, 17625, 24743, 32768, 40793,
                                        47911, 53581, 57724, 60565, 62428, 63615, 64357, 64816, 65097,
                                        65269, 65374, 65438, 65476, 65500, 65514};
    const int step = (logit >> 7) + 16;
    const auto place = static_cast<size_t>(step);
    const int beyond = logit & 127;
    return (table[place] * (128 - beyond) + table[place + 1] * beyond + 64) >> 7;
}

/// For probabilities in units of 2^-12.
constexpr auto logits = [] {
    std::array<std::int16_t, 4096> table{};
    size_t next = 0;
    for (int logit = -largest_logit; logit <= largest_logit; ++logit)
        for (; next <= static_cast<size_t>(probability_of_logit(logit) >> 4); ++next)
            table[next] = static_cast<std::int16_t>(logit);
    for (; next < table.size(); ++next) table[next] = largest_logit;
    return table;
}();

/// What the decisions so far leave of all codes.
class CodeInterval {
  public:
    [[nodiscard]] std::uint32_t middle(int probability) const {
        const std::uint64_t length = high_ - low_;
        return low_ + static_cast<std::uint32_t>(length * static_cast<std::uint64_t>(probability) >> 16);
    }
    void keep(bool lower, std::uint32_t middle) {
        if (lower)
            high_ = middle;
        else
            low_ = middle + 1;
    }
    [[nodiscard]] bool first_byte_is_known() const { return (low_ ^ high_) < 1U << 24; }
    [[nodiscard]] std::uint8_t first_byte() const { return static_cast<std::uint8_t>(low_ >> 24); }
    void drop_first_byte() {
        low_ <<= 8;
        high_ = high_ << 8 | 255U;
    }

  private:
    std::uint32_t low_ = 0, high_ = std::numeric_limits<std::uint32_t>::max();
};

class LabelEncoder {
  public:
    bool code(bool bit, int probability) {
        interval_.keep(bit, interval_.middle(probability));
        for (; interval_.first_byte_is_known(); interval_.drop_first_byte())
            bytes_.push_back(interval_.first_byte());
        return bit;
    }
    static constexpr bool ran_out() { return false; }
    /// All bytes. Those beyond the end count as 0.
    std::vector<std::uint8_t> finish() {
        bytes_.push_back(static_cast<std::uint8_t>(interval_.first_byte() + 1));
        return std::move(bytes_);
    }

  private:
    CodeInterval interval_;
    std::vector<std::uint8_t> bytes_;
};

class LabelDecoder {
  public:
    explicit LabelDecoder(std::span<const std::uint8_t> bytes) : bytes_(bytes) {
        for (int k = 0; k < 4; ++k) read_byte();
    }
    bool code(bool, int probability) {
        const std::uint32_t middle = interval_.middle(probability);
        const bool bit = value_ <= middle;
        interval_.keep(bit, middle);
        for (; interval_.first_byte_is_known(); interval_.drop_first_byte()) read_byte();
        return bit;
    }

    /// Every byte that is read is one that the encoder wrote, but for the last three.
    [[nodiscard]] bool ran_out() const { return missing_ > 3; }
    [[nodiscard]] bool used_up() const { return missing_ == 3; }

  private:
    void read_byte() {
        if (bytes_.empty()) ++missing_;
        value_ = value_ << 8 | (bytes_.empty() ? 0U : bytes_.front());
        if (!bytes_.empty()) bytes_ = bytes_.subspan(1);
    }
    CodeInterval interval_;
    std::uint32_t value_ = 0;
    std::uint64_t missing_ = 0;
    std::span<const std::uint8_t> bytes_;
};

/// Labels around the one to be coded; outside the field, those of what is nearest.
struct LabelContext {
    /// \param labels  those before `place` are known
    LabelContext(std::span<const std::uint8_t> labels, Size size, int row, int column) {
        const size_t width = static_cast<size_t>(size.width);
        const std::uint8_t* here =
            labels.data() + static_cast<size_t>(row) * width + static_cast<size_t>(column);
        const auto above = [&](size_t rows) { return here - rows * width; };
        west = column > 0 ? here[-1] : row > 0 ? *above(1) : 0;
        north = row > 0 ? *above(1) : west;
        north_west = row > 0 && column > 0 ? above(1)[-1] : north;
        north_east = row > 0 && column + 1 < size.width ? above(1)[1] : north;
        west_west = column > 1 ? here[-2] : west;
        north_north = row > 1 ? *above(2) : north;
        north_north_east = row > 1 && column + 1 < size.width ? above(2)[1] : north_east;
    }
    /// Which of the nearest are the same, below mixer_sets.
    [[nodiscard]] size_t pattern() const {
        return (west == north ? 1U : 0U) + (north == north_east ? 2U : 0U) + (north == north_west ? 4U : 0U);
    }
    [[nodiscard]] std::array<std::uint32_t, context_models> hashes() const;

    int west = 0, north = 0, north_west = 0, north_east = 0;
    int west_west = 0, north_north = 0, north_north_east = 0;
};

std::array<std::uint32_t, context_models> LabelContext::hashes() const {
    const auto hash = [](std::initializer_list<int> labels) {
        std::uint32_t h = 0;
        for (const int label : labels) h = h * 37U + static_cast<std::uint32_t>(label + 3);
        return h;
    };
    const auto side = [&](int label) { return std::clamp(label - north, -1, 1); };
    const auto apart = [&](int label) { return std::clamp(label - west, -2, 2); };
    const int w = west, n = north, ne = north_east, nw = north_west;
    return {hash({w, n, side(ne), side(nw)}),
            hash({w, n}),
            hash({w, n, nw, ne}),
            hash({apart(n), apart(nw), apart(ne), apart(west_west), apart(north_north)}),
            hash({w, n, nw, ne, west_west, north_north}),
            hash({w, n, west_west, north_north, side(ne)}),
            hash({w, n, ne, north_north_east, side(nw)})};
}

/// Probabilities of decisions, learnt from those before.
class LabelModel {
  public:
    explicit LabelModel(size_t pixels)
        : table_bits_(
              std::clamp(static_cast<int>(std::bit_width(pixels)) + 1, least_table_bits, most_table_bits)),
          tables_(context_models, std::vector<Probability>(size_t{1} << table_bits_)),
          mixers_(mixer_sets * decisions, initial_weights()) {}

    /// Codes a decision, which the decoder does not know yet.
    template <class Coder>
    bool code(Coder& coder, bool bit, size_t decision) {
        const int probability = predict(decision);
        bit = coder.code(bit, probability);
        learn(bit ? one - probability : -probability, bit);
        return bit;
    }
    void enter(const LabelContext& context) {
        hashes_ = context.hashes();
        pattern_ = context.pattern();
    }

  private:
    struct Probability {
        std::uint16_t value = one / 2, known = 0;
    };
    /// The last is that of a constant.
    using Weights = std::array<int, context_models + 1>;
    static constexpr int constant = 256;

    int predict(size_t decision) {
        weights_ = &mixers_[pattern_ * decisions + decision];
        std::int64_t sum = std::int64_t{weights_->back()} * constant;
        for (size_t m = 0; m < context_models; ++m) {
            std::uint32_t hash =
                (hashes_[m] + static_cast<std::uint32_t>(decision) * 0x9e3779b1U) * 0x85ebca6bU;
            hash = (hash ^ hash >> 15) * 0xc2b2ae35U;
            chosen_[m] = &tables_[m][hash >> (32 - table_bits_)];
            inputs_[m] = logits[chosen_[m]->value >> 4];
            sum += std::int64_t{(*weights_)[m]} * inputs_[m];
        }
        return probability_of_logit(
            static_cast<int>(std::clamp<std::int64_t>(sum >> 16, -largest_logit, largest_logit)));
    }
    void learn(int error, bool bit) {
        inputs_.back() = constant;
        for (size_t m = 0; m < inputs_.size(); ++m) {
            const int step = (inputs_[m] * error + (1 << (learning_shift - 1))) >> learning_shift;
            (*weights_)[m] = std::clamp((*weights_)[m] + step, -largest_weight, largest_weight);
        }
        for (Probability* p : chosen_) {
            const int left = (bit ? one - 1 : 0) - p->value;
            p->value = static_cast<std::uint16_t>(p->value + left * 2 / (2 * p->known + 3));
            p->known = static_cast<std::uint16_t>(std::min(p->known + 1, most_known));
        }
    }

    static Weights initial_weights() {
        Weights weights;
        weights.fill(first_weight);
        weights.back() = 0;
        return weights;
    }

    int table_bits_;
    std::vector<std::vector<Probability>> tables_;
    std::vector<Weights> mixers_;
    std::array<std::uint32_t, context_models> hashes_{};
    size_t pattern_ = 0;
    std::array<Probability*, context_models> chosen_{};
    Weights* weights_ = nullptr;
    std::array<int, context_models + 1> inputs_{};
};

/// Codes a label that is not the left neighbour's: the upper one's, or so many steps from the left one, above
/// or below. What no label is left for is not asked.
template <class Coder>
int code_other_label(Coder& coder, LabelModel& model, const LabelContext& context, int regions, int label) {
    const int west = context.west, north = context.north;
    int below = west, above = regions - 1 - west;
    if (north != west) {
        if (below + above == 1 || model.code(coder, label == north, 1)) return north;
        --(north < west ? below : above);
    }
    const bool up = below == 0 || (above > 0 && model.code(coder, label > west, 2));
    int candidate = west;
    for (int left = up ? above : below, steps = 0; left > 0; --left, ++steps) {
        const int step = up ? 1 : -1;
        candidate += candidate + step == north ? 2 * step : step;
        const auto told_apart = static_cast<size_t>(std::min(steps, most_steps_told_apart - 1));
        const size_t decision = 3 + told_apart + (up ? most_steps_told_apart : 0);
        if (left == 1 || model.code(coder, label == candidate, decision)) break;
    }
    return candidate;
}

/// The same for both coders: an encoder is told the labels, a decoder tells them.
template <class Coder>
void code_labels(Coder& coder, Size size, int regions, std::span<std::uint8_t> labels) {
    LabelModel model(labels.size());
    size_t i = 0;
    for (int row = 0; row < size.height && !coder.ran_out(); ++row)
        for (int column = 0; column < size.width; ++column, ++i) {
            const LabelContext context(labels, size, row, column);
            model.enter(context);
            const bool same = model.code(coder, labels[i] == context.west, 0);
            labels[i] = static_cast<std::uint8_t>(
                same ? context.west : code_other_label(coder, model, context, regions, labels[i]));
        }
}

/// FNV-1a of what is coded: no label changes alone without changing it.
std::uint32_t checksum_of(Size size, int regions, std::span<const std::uint8_t> labels) {
    std::uint32_t sum = 0x811c9dc5U;
    const auto add = [&](std::uint32_t value) { sum = (sum ^ value) * 0x01000193U; };
    add(static_cast<std::uint32_t>(size.height));
    add(static_cast<std::uint32_t>(size.width));
    add(static_cast<std::uint32_t>(regions));
    for (const std::uint8_t label : labels) add(label);
    return sum;
}

}  // namespace

std::vector<std::uint8_t> encode_labels(const ControlField& field) {
    check(field);
    LabelEncoder encoder;
    std::vector<std::uint8_t> labels = field.labels;
    code_labels(encoder, field.size, field.regions, labels);
    std::vector<std::uint8_t> code = encoder.finish();
    const std::uint32_t sum = checksum_of(field.size, field.regions, labels);
    for (size_t k = 0; k < checksum_bytes; ++k) code.push_back(static_cast<std::uint8_t>(sum >> 8 * k));
    return code;
}

std::vector<std::uint8_t> decode_labels(std::span<const std::uint8_t> code, Size size, int regions,
                                        const std::string& asked) {
    if (size.height < 1 || size.width < 1 || regions < 1 || regions > most_regions)
        throw InputError(asked,
                         "labels of " + counted(regions, "region") + " on " + text_of(size) + " pixels",
                         "give sizes from 1 on and 1 to " + counted(most_regions, "region"));
    const char* remedy = "use the file as it was written";
    if (code.size() < checksum_bytes || area(size) / most_pixels_per_byte > code.size())
        throw InputError(asked, "the code of the labels is too short for " + text_of(size) + " pixels",
                         remedy);
    LabelDecoder decoder(code.first(code.size() - checksum_bytes));
    std::vector<std::uint8_t> labels(area(size));
    code_labels(decoder, size, regions, labels);
    std::uint32_t sum = 0;
    for (size_t k = 0; k < checksum_bytes; ++k)
        sum |= std::uint32_t{code[code.size() - checksum_bytes + k]} << 8 * k;
    if (!decoder.used_up() || sum != checksum_of(size, regions, labels))
        throw InputError(asked, "the code of the labels is damaged", remedy);
    return labels;
}

}  // namespace btfield::detail
