#include "host/base/temporary_names.hpp"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <thread>
#include <vector>

#include "host/base/file_output.hpp"
#include "tests/temporary_folder.hpp"

namespace btfield {

using namespace detail;

namespace {

namespace fs = std::filesystem;
using test::put_bytes;
using test::TemporaryFolder;

/// What a process does between fork and its end.
template <typename Work>
int in_a_process(Work work) {
    const pid_t child = ::fork();
    if (child == 0) {
        work();
        ::_exit(0);
    }
    int status = -1;
    ::waitpid(child, &status, 0);
    return status;
}

TEST(TemporaryNames, NotedFilesAndFoldersGo) {
    const TemporaryFolder folder;
    EXPECT_EQ(in_a_process([&] {
                  const TemporaryStep* step = new TemporaryStep;
                  step->note(folder / "gone");
                  step->note(folder / "below");
                  step->note(folder / "kept");
                  step->note(folder / "never made");
                  step->forget(folder / "kept");
                  delete step;
                  put_bytes(folder / "gone", "x");
                  put_bytes(folder / "kept", "x");
                  fs::create_directories(folder / "below/deeper");
                  put_bytes(folder / "below/deeper/file", "x");
                  remove_temporaries();
              }),
              0);
    EXPECT_EQ(folder.names(), std::vector<std::string>{"kept"});
}

/// The end comes while four threads make, finish and give up files: none with a hidden name is left, whatever
/// each was doing.
TEST(TemporaryNames, NothingIsLeftWhereverThreadsAre) {
    const TemporaryFolder folder;
    for (int end = 0; end < 12; ++end) {
        EXPECT_EQ(in_a_process([&] {
                      std::atomic<int> made{0};
                      for (int thread = 0; thread < 4; ++thread) {
                          std::thread([&, thread] {
                              for (;; ++made) {
                                  const std::string name = "f" + std::to_string(thread);
                                  FileOutput output(folder / name, "write", true);
                                  put_bytes(output.temporary(), "x");
                                  if (made % 2 == 0) output.commit(false);
                              }
                          }).detach();
                      }
                      while (made < 10 + 9 * end) std::this_thread::yield();
                      remove_temporaries();
                  }),
                  0);
        for (const std::string& name : folder.names()) EXPECT_NE(name.front(), '.') << name;
    }
}

}  // namespace
}  // namespace btfield
