#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>
#include <utility>

#include "btfield/error.hpp"
#include "btfield/experiment.hpp"
#include "btfield/stop.hpp"
#include "btfield/threads.hpp"
#include "host/base/stop.hpp"
#include "host/experiment/config_text.hpp"
#include "host/experiment/ledger.hpp"
#include "host/experiment/messages.hpp"
#include "host/experiment/picture_work.hpp"
#include "host/experiment/set_pictures.hpp"

namespace btfield {

using namespace detail;

namespace {

using namespace std::chrono_literals;

/// How often a rank looks for messages, and how often progress is told.
constexpr auto message_interval = 1ms;
constexpr auto own_interval = 10ms;
constexpr auto progress_interval = 200ms;

int thread_count(const ExperimentRunOptions& options) {
    if (options.jobs > 0) return options.jobs;
    if (options.ranks != nullptr && options.ranks->size() > 1)
        return 1;  // whoever starts ranks counts the cores
    return thread_limit();
}

/// \throws InputError where the name is that of something else
std::filesystem::path texture_folder(const ExperimentRunOptions& options) {
    if (options.textures.empty()) return {};
    std::filesystem::path folder = std::filesystem::absolute(options.textures);
    std::error_code error;
    if (std::filesystem::exists(folder, error) && !std::filesystem::is_directory(folder, error)) {
        throw InputError("keep the best textures in '" + options.textures.string() + "'", "that is no folder",
                         "name a folder, or one that is to be made");
    }
    return folder;
}

[[noreturn]] void throw_stopped() {
    throw Stopped("run the experiment", "a StopScope of the caller's ends it",
                  "run it again: the database has what was done");
}

void tell_all(ExperimentRanks& ranks, const RankMessage& message) {
    const std::string bytes = to_bytes(message);
    for (int rank = 1; rank < ranks.size(); ++rank) ranks.send(rank, bytes);
}

// --- rank 0, or the only process
// ---------------------------------------------------------------------------------

class Head {
  public:
    Head(const ExperimentConfig& config, const std::filesystem::path& database,
         const ExperimentRunOptions& options)
        : config_(config),
          options_(options),
          textures_(texture_folder(options)),
          ranks_(options.ranks != nullptr && options.ranks->size() > 1 ? options.ranks : nullptr),
          ledger_(config, database, options, sets_,
                  thread_count(options) * (ranks_ != nullptr ? ranks_->size() : 1)) {}

    ExperimentResult run() {
        if (ranks_ != nullptr) welcome();
        std::exception_ptr trouble;
        {
            std::vector<std::jthread> threads;
            active_ = ledger_.finished() ? 0 : thread_count(options_);
            for (int t = active_; t > 0; --t) threads.emplace_back([this] { work(); });
            auto told = std::chrono::steady_clock::now();
            while (active_ > 0 || away_ > 0) {
                try {
                    if (scope_ != nullptr && !broken_off_ && scope_->asked()) broken_off_ = true;
                    if (!stopping_ && (broken_off_ || wants_to_stop())) stop();
                    const bool busy = ranks_ != nullptr && exchange();
                    const auto now = std::chrono::steady_clock::now();
                    if (options_.progress && !trouble && now - told >= progress_interval) {
                        told = now;
                        options_.progress(ledger_.progress());
                    }
                    if (!busy)
                        std::this_thread::sleep_for(ranks_ != nullptr ? message_interval : own_interval);
                } catch (...) {
                    if (!trouble) trouble = std::current_exception();
                    if (!stopping_) stop();
                }
            }
        }
        ExperimentResult result = ledger_.conclude();
        if (trouble) std::rethrow_exception(trouble);
        if (broken_off_) throw_stopped();
        if (result.interrupted && !stopping_ && device_error_) std::rethrow_exception(device_error_);
        if (options_.progress) options_.progress(result);
        return result;
    }

  private:
    [[nodiscard]] bool wants_to_stop() const { return options_.stop && options_.stop(); }

    void stop() {
        stopping_ = true;
        ledger_.stop();
        if (ranks_ != nullptr) {
            RankMessage message;
            message.kind = MessageKind::stop;
            tell_all(*ranks_, message);
        }
    }

    void work() {
        const InheritedStop inherited(scope_);
        try {
            PictureWork work(config_, options_.device, textures_, sets_);
            while (const std::optional<WorkUnit> unit = ledger_.wait_for_next()) {
                work.run(
                    *unit, [this](const WorkReport& report) { ledger_.take(report); },
                    [this] { return stopping_ || wants_to_stop(); });
                ledger_.unit_ended();
            }
        } catch (const Stopped&) {
            broken_off_ = true;
        } catch (...) {
            lost(std::current_exception());
        }
        --active_;
    }

    void lost(std::exception_ptr error) {
        const std::lock_guard lock(mutex_);
        if (!device_error_) device_error_ = std::move(error);
    }

    void welcome() {
        away_ = ranks_->size() - 1;
        RankMessage message;
        message.kind = MessageKind::welcome;
        message.text = config_.text;
        message.folder = config_.folder.string();
        message.textures = textures_.string();
        tell_all(*ranks_, message);
    }

    /// Handles one message and the requests that wait; true when something happened.
    bool exchange() {
        std::optional<ExperimentRanks::Message> message = ranks_->receive();
        if (message) handle(message->rank, rank_message(message->bytes));
        for (std::size_t i = 0; i < waiting_.size();) {
            const auto [rank, thread] = waiting_[i];
            RankMessage reply;
            reply.kind = MessageKind::unit;
            reply.thread = thread;
            reply.unit = ledger_.next();
            if (!reply.unit && !ledger_.finished()) {
                ++i;
                continue;
            }
            ranks_->send(rank, to_bytes(reply));
            waiting_.erase(waiting_.begin() + static_cast<std::ptrdiff_t>(i));
        }
        return message.has_value();
    }

    void handle(int rank, const RankMessage& message) {
        switch (message.kind) {
            case MessageKind::ended:
                ledger_.unit_ended();
                break;
            case MessageKind::request:
                waiting_.emplace_back(rank, message.thread);
                break;
            case MessageKind::report:
                ledger_.take(message.report);
                break;
            case MessageKind::lost:
                lost(std::make_exception_ptr(DeviceError("work on rank " + std::to_string(rank), message.text,
                                                         "choose another --device for that rank")));
                break;
            case MessageKind::left:
                --away_;
                break;
            case MessageKind::welcome:
            case MessageKind::unit:
            case MessageKind::stop:
                break;  // only rank 0 sends these
        }
    }

    const ExperimentConfig& config_;
    const ExperimentRunOptions& options_;
    const std::filesystem::path textures_;
    ExperimentRanks* ranks_;
    OpenSets sets_;
    Ledger ledger_;
    std::atomic<int> active_{0};  ///< own threads
    int away_ = 0;                ///< other ranks
    std::atomic<bool> stopping_{false};
    const StopScope* const scope_ = StopScope::current();
    std::atomic<bool> broken_off_{false};       ///< by the scope
    std::vector<std::pair<int, int>> waiting_;  ///< rank and thread
    std::mutex mutex_;
    std::exception_ptr device_error_;
};

// --- other ranks
// -------------------------------------------------------------------------------------------------

class Hand {
  public:
    explicit Hand(const ExperimentRunOptions& options) : options_(options), ranks_(*options.ranks) {}

    void run() {
        try {
            work_until_the_end();
        } catch (const Stopped&) {
            throw;
        } catch (const std::exception& error) {
            RankMessage message;
            message.kind = MessageKind::lost;
            message.text = error.what();
            send(message);
            send(MessageKind::left);
            flush();
        }
    }

  private:
    void work_until_the_end() {
        if (!await_welcome()) return;
        const int count = thread_count(options_);
        replies_.resize(static_cast<std::size_t>(count));
        active_ = count;
        {
            std::vector<std::jthread> threads;
            threads.reserve(static_cast<std::size_t>(count));
            for (int t = 0; t < count; ++t) threads.emplace_back([this, t] { work(t); });
            while (active_ > 0 || !outbox_empty()) {
                const bool sent = flush();
                if (!receive() && !sent) std::this_thread::sleep_for(message_interval);
            }
        }
        send(MessageKind::left);
        flush();
        if (broken_off_) throw_stopped();
    }

    [[nodiscard]] bool wants_to_stop() const {
        return stopping_ || broken_off_ || (options_.stop && options_.stop());
    }

    bool await_welcome() {
        for (;;) {
            const auto message = ranks_.receive();
            if (!message) {
                std::this_thread::sleep_for(message_interval);
                continue;
            }
            const RankMessage first = rank_message(message->bytes);
            if (first.kind != MessageKind::welcome) return false;
            config_ = experiment_from_text(first.text, first.folder, "read the experiment that rank 0 sent");
            textures_ = first.textures;
            return true;
        }
    }

    void work(int thread) {
        const InheritedStop inherited(scope_);
        try {
            PictureWork work(config_, options_.device, textures_, sets_);
            while (!wants_to_stop()) {
                const std::optional<WorkUnit> unit = ask(thread);
                if (!unit) break;
                const auto report = [this](WorkReport results) {
                    RankMessage message;
                    message.kind = MessageKind::report;
                    message.report = std::move(results);
                    send(message);
                };
                try {
                    work.run(*unit, report, [this] { return wants_to_stop(); });
                } catch (const Stopped&) {
                    broken_off_ = true;
                }
                send(MessageKind::ended);
            }
        } catch (const Stopped&) {
            broken_off_ = true;
        } catch (const std::exception& error) {
            RankMessage message;
            message.kind = MessageKind::lost;
            message.text = error.what();
            send(message);
        }
        --active_;
    }

    std::optional<WorkUnit> ask(int thread) {
        RankMessage message;
        message.kind = MessageKind::request;
        message.thread = thread;
        send(message);
        std::unique_lock lock(mutex_);
        auto& reply = replies_[static_cast<std::size_t>(thread)];
        changed_.wait(lock, [&] { return reply.has_value(); });
        return std::exchange(reply, std::nullopt)->unit;
    }

    void send(const RankMessage& message) {
        const std::lock_guard lock(mutex_);
        outbox_.push_back(to_bytes(message));
    }
    void send(MessageKind kind) {
        RankMessage message;
        message.kind = kind;
        send(message);
    }

    bool outbox_empty() {
        const std::lock_guard lock(mutex_);
        return outbox_.empty();
    }

    bool flush() {
        std::vector<std::string> out;
        {
            const std::lock_guard lock(mutex_);
            out.swap(outbox_);
        }
        for (const std::string& bytes : out) ranks_.send(0, bytes);
        return !out.empty();
    }

    bool receive() {
        const auto message = ranks_.receive();
        if (!message) return false;
        RankMessage news = rank_message(message->bytes);
        if (news.kind == MessageKind::stop) stopping_ = true;
        if (news.kind == MessageKind::unit) {
            const std::lock_guard lock(mutex_);
            replies_[static_cast<std::size_t>(news.thread)] = std::move(news);
            changed_.notify_all();
        }
        return true;
    }

    const ExperimentRunOptions& options_;
    ExperimentRanks& ranks_;
    ExperimentConfig config_;
    std::filesystem::path textures_;
    OpenSets sets_;
    std::atomic<int> active_{0};
    std::atomic<bool> stopping_{false};
    const StopScope* const scope_ = StopScope::current();
    std::atomic<bool> broken_off_{false};  ///< by the scope
    std::mutex mutex_;
    std::condition_variable changed_;
    std::vector<std::string> outbox_;
    std::vector<std::optional<RankMessage>> replies_;
};

}  // namespace

ExperimentResult run_experiment(const ExperimentConfig& config, const std::filesystem::path& database,
                                const ExperimentRunOptions& options) {
    if (options.ranks != nullptr && options.ranks->rank() > 0) {
        Hand(options).run();
        return {};
    }
    std::unique_ptr<Head> head;
    try {
        head = std::make_unique<Head>(config, database, options);
    } catch (...) {
        if (options.ranks != nullptr) dismiss(*options.ranks);
        throw;
    }
    return head->run();
}

void dismiss(ExperimentRanks& ranks) {
    RankMessage message;
    message.kind = MessageKind::stop;
    tell_all(ranks, message);
}

ExperimentResult merge_experiments(const std::vector<std::filesystem::path>& inputs,
                                   const std::filesystem::path& output) {
    const auto start = std::chrono::steady_clock::now();
    const std::string asked = "merge into '" + output.string() + "'";
    std::error_code error;
    if (std::filesystem::exists(output, error)) {
        throw InputError(asked, "the file exists", "choose a name that is free");
    }
    ExperimentResult result;
    ResultsDatabase database(output, asked);
    for (const std::filesystem::path& input : inputs) database.absorb(input);
    const auto counts = database.count();
    const auto of = [&](JobStatus status) {
        const auto found = counts.find(status);
        return found == counts.end() ? 0 : found->second;
    };
    result.done = of(JobStatus::done);
    result.refused = of(JobStatus::refused);
    result.failed = of(JobStatus::failed);
    result.jobs = result.done + result.refused + result.failed;
    database.close();
    result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    return result;
}

}  // namespace btfield
