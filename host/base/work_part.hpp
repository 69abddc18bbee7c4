#pragma once

// How long work tells how far it is (btfield/progress.hpp).

#include <mutex>
#include <string>
#include <string_view>

#include "btfield/progress.hpp"
#include "host/base/parallel.hpp"

namespace btfield::detail {

class Stage;

/// A share of the innermost part of this thread, which it takes the place of while it lives; its end is that
/// of its work. Threads that for_each_block() hands blocks to are in the part of the thread that did. Where
/// nobody wants to know, it does nothing.
class WorkPart {
  public:
    explicit WorkPart(double share) : WorkPart(share, nullptr) {}
    ~WorkPart();
    WorkPart(const WorkPart&) = delete;
    WorkPart& operator=(const WorkPart&) = delete;

    /// So much of this part is done at least, 0 to 1.
    /// \throws Stopped when a StopScope of this thread says so; and whatever the caller's function throws
    void done(double share);
    /// As done(), of work that ends nobody knows when: `portion` of what is left of it.
    void nearer(double portion);
    [[nodiscard]] double counted() const;

  private:
    friend class Stage;
    /// \param whole  the stage of which this is all; null: of a part's
    WorkPart(double share, Stage* whole);
    /// Under the stage's mutex.
    void count(double more);

    WorkPart* outer_;
    double share_;
    Stage* whole_;
    double counted_ = 0.0;
};

/// A whole that parts are shares of: told by name to the ProgressScope of this thread. Inside of another
/// stage, part of that one's work, it is not told.
class Stage {
  public:
    explicit Stage(std::string_view name);

  private:
    friend class WorkPart;
    void tell(double share);

    std::string name_;
    const ProgressScope* scope_;
    std::mutex counting_;
    double told_ = 0.0;
    WorkPart all_;
};

/// WorkPart::done() and nearer() of the innermost part of this thread.
void work_done(double share);
void work_nearer(double portion);
/// What of it is counted already.
[[nodiscard]] double work_counted();

/// Of what is left of a descent, by a step: most take some thirty.
inline constexpr double share_of_step = 0.03;
/// Of what is left of a fit, by a descent: most take some ten.
inline constexpr double share_of_descent = 0.15;

/// for_each_block() of blocks that are as large a share of the innermost part each.
template <class Work>
void for_each_part(int parts, const Work& work) {
    for_each_block(parts, [&](int part) {
        WorkPart share(1.0 / parts);
        work(part);
        share.done(1.0);
    });
}

/// Makes this thread work in a part of another thread, which outlives it; null: in none.
class InheritedPart {
  public:
    explicit InheritedPart(WorkPart* of);
    ~InheritedPart();
    InheritedPart(const InheritedPart&) = delete;
    InheritedPart& operator=(const InheritedPart&) = delete;

  private:
    WorkPart* before_;
};

/// The innermost part of this thread; null: none.
[[nodiscard]] WorkPart* current_part();
/// Another one in its place, which it returns.
WorkPart* exchange_part(WorkPart* part);

}  // namespace btfield::detail
