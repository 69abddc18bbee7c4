#include "host/btf/views_part.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <span>
#include <utility>
#include <vector>

#include "host/btf/btf_names.hpp"

namespace btfield::detail {
namespace {

/// A record: these, then double precision numbers (energy, what is lost of it, means, contrasts, offsets, A
/// row by row, units), then B.
struct ViewHead {
    std::uint64_t view = 0, rows = 0, rank = 0, pixels = 0;
};

nlohmann::ordered_json options_of(const BtfLeaveOut& leave_out, int rank) {
    nlohmann::ordered_json value;
    value["method"] = name(BtfMethod::joint);
    value["leave_out"] = {leave_out.pairs, leave_out.views, leave_out.lights};
    value["rank"] = rank;
    return value;
}

std::uint64_t reals_of(const ViewHead& head) {
    return 2 + 3 * head.rows + head.rows * head.rank + head.rank;
}

/// Takes numbers one after the other.
class Reals {
  public:
    explicit Reals(std::span<const std::byte> bytes) : rest_(bytes) {}
    void take(std::span<double> to) {
        if (to.empty()) return;  // nothing has no address to copy from
        std::memcpy(to.data(), rest_.data(), to.size_bytes());
        rest_ = rest_.subspan(to.size_bytes());
        finite_ &= std::ranges::all_of(to, [](double value) { return std::isfinite(value); });
    }
    [[nodiscard]] std::vector<double> take(std::size_t count) {
        std::vector<double> values(count);
        take(values);
        return values;
    }
    [[nodiscard]] bool finite() const { return finite_; }

  private:
    std::span<const std::byte> rest_;
    bool finite_ = true;
};

}  // namespace

ViewsPart::ViewsPart(const std::filesystem::path& path, const BtfSet& set, const BtfLeaveOut& leave_out,
                     int rank)
    : file_(path, set, options_of(leave_out, rank)), pixels_(area(set.size())), rank_(rank) {
    for (const PartRecord& record : file_.records()) {
        if (record.bytes < sizeof(ViewHead)) continue;
        ViewHead head;
        std::memcpy(&head, file_.mapped(record).first.get(), sizeof head);
        records_.insert_or_assign(head.view, record);
    }
}

std::optional<ReducedView> ViewsPart::find(std::size_t view, std::size_t rows) const {
    const auto found = records_.find(view);
    return found == records_.end() ? std::nullopt : read(found->second, rows);
}

/// Nothing where the record does not fit.
std::optional<ReducedView> ViewsPart::read(const PartRecord& record, std::size_t rows) const {
    const MappedBytes mapped = file_.mapped(record);
    const std::span<const std::byte> all = mapped.span();
    ViewHead head;
    std::memcpy(&head, all.data(), sizeof head);
    const auto most = std::min(static_cast<std::uint64_t>(rank_), head.rows);
    if (head.rows != rows || head.rank > most || head.pixels != pixels_) return std::nullopt;
    const std::uint64_t reals = reals_of(head) * sizeof(double);
    const std::uint64_t numbers = head.rank * head.pixels;
    if (record.bytes != sizeof head + reals + numbers * sizeof(std::int16_t)) return std::nullopt;

    ReducedView view;
    Reals from(all.subspan(sizeof head, reals));
    from.take({&view.energy, 1});
    from.take({&view.lost, 1});
    view.mean = from.take(head.rows);
    view.contrast = from.take(head.rows);
    view.offset = from.take(head.rows);
    view.basis.resize(static_cast<Eigen::Index>(head.rows), static_cast<Eigen::Index>(head.rank));
    from.take({view.basis.data(), head.rows * head.rank});
    view.units = from.take(head.rank);
    if (!from.finite()) return std::nullopt;
    // Records begin at multiples of 8, and so do numbers behind whole numbers of doubles.
    const auto* const first = reinterpret_cast<const std::int16_t*>(all.data() + sizeof head + reals);
    view.values = SharedNumbers(mapped.first, {first, numbers});
    return view;
}

ReducedView ViewsPart::kept(std::size_t view, ReducedView reduced) {
    if (!file_.keeps()) return reduced;
    const ViewHead head{view, reduced.mean.size(), reduced.rank(), pixels_};
    const std::array<double, 2> sums{reduced.energy, reduced.lost};
    const std::span<const double> basis(reduced.basis.data(), static_cast<std::size_t>(reduced.basis.size()));
    const PartRecord record =
        file_.append({std::as_bytes(std::span(&head, 1)), std::as_bytes(std::span(sums)),
                      std::as_bytes(std::span(reduced.mean)), std::as_bytes(std::span(reduced.contrast)),
                      std::as_bytes(std::span(reduced.offset)), std::as_bytes(basis),
                      std::as_bytes(std::span(reduced.units)), std::as_bytes(reduced.values.span())});
    // What is not a number in it is no file's fault.
    std::optional<ReducedView> mapped = read(record, reduced.mean.size());
    return mapped ? std::move(*mapped) : std::move(reduced);
}

}  // namespace btfield::detail
