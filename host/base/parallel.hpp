#pragma once

// Work shared among the machine's cores such that the result does not depend on how many there are.

namespace btfield::detail {

/// What for_each_block() runs: `call(work, block)`.
struct BlockWork {
    const void* work;
    void (*call)(const void* work, int block);
};
void run_blocks(int blocks, BlockWork work);

/// Calls work(block) once for every block in [0, blocks), on at most thread_limit() threads, the caller's own
/// included, in no particular order; the other threads are those of the whole process. Blocks write to places
/// of their own, and whoever reduces them does so in block order afterwards: that makes sums independent of
/// the number of threads. Blocks may share work out themselves: threads that have nothing else to do help
/// with the outermost loop that has blocks left. The exception of the lowest block that threw one is passed
/// on, after all have ended. Where a StopScope says so, blocks throw Stopped instead of beginning.
template <class Work>
void for_each_block(int blocks, const Work& work) {
    run_blocks(blocks, {&work, [](const void* of, int block) { (*static_cast<const Work*>(of))(block); }});
}

}  // namespace btfield::detail
