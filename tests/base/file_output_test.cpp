#include "host/base/file_output.hpp"

#include <gtest/gtest.h>

#include <fcntl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstring>
#include <stdexcept>
#include <string>

#include "btfield/error.hpp"
#include "tests/full_disk.hpp"
#include "tests/temporary_folder.hpp"

namespace btfield {

using namespace detail;

namespace {

namespace fs = std::filesystem;
using test::bytes_of;
using test::put_bytes;
using test::TemporaryFolder;
using Names = std::vector<std::string>;

std::string failure(auto&& action) {
    try {
        action();
    } catch (const InputError& error) {
        return error.what();
    }
    return "no error";
}

bool contains(const std::string& text, std::string_view part) {
    return text.find(part) != std::string::npos;
}

/// Whether the file under construction has a hidden name in its folder, as where it cannot be without.
class FileOutputNames : public testing::TestWithParam<bool> {};
INSTANTIATE_TEST_SUITE_P(HiddenOrNone, FileOutputNames, testing::Bool());

TEST_P(FileOutputNames, appears_only_with_commit) {
    const TemporaryFolder folder;
    for (const std::string_view old : {"", "old"}) {
        if (!old.empty()) put_bytes(folder / "a.png", old);
        FileOutput output(folder / "a.png", "write 'a.png'", GetParam());
        put_bytes(output.temporary(), "complete");
        for (const std::string& name : folder.names())
            EXPECT_TRUE(name == "a.png" || (GetParam() && name.front() == '.')) << name;
        EXPECT_EQ(fs::exists(folder / "a.png"), !old.empty());
        output.commit();
        EXPECT_EQ(folder.names(), Names{"a.png"});
        EXPECT_EQ(bytes_of(folder / "a.png"), "complete");
    }
}

TEST_P(FileOutputNames, no_writer_brings_back_what_is_removed) {
    const TemporaryFolder folder;
    const FileOutput output(folder / "a.png", "write", GetParam());
    for (const std::string& name : folder.names()) fs::remove(folder / name);
    put_bytes(output.temporary(), "late");
    EXPECT_TRUE(folder.names().empty());
}

TEST(file_output, leaves_nothing_without_commit) {
    const TemporaryFolder folder;
    put_bytes(folder / "old.png", "old");
    { const FileOutput output(folder / "new.png", "write"); }
    EXPECT_THROW(
        {
            const FileOutput output(folder / "old.png", "write");
            put_bytes(output.temporary(), "half of");
            throw std::runtime_error("in between");
        },
        std::runtime_error);
    EXPECT_EQ(folder.names(), Names{"old.png"});
    EXPECT_EQ(bytes_of(folder / "old.png"), "old");
}

TEST(file_output, two_at_once_do_not_meet) {
    const TemporaryFolder folder;
    FileOutput first(folder / "a.json", "write");
    FileOutput second(folder / "a.json", "write");
    EXPECT_NE(first.temporary(), second.temporary());
    put_bytes(first.temporary(), "first");
    put_bytes(second.temporary(), "second");
    first.commit();
    second.commit();
    EXPECT_EQ(bytes_of(folder / "a.json"), "second");
    EXPECT_EQ(folder.names(), Names{"a.json"});
}

TEST(file_output, steps_over_what_a_killed_process_left) {
    const TemporaryFolder folder;
    std::string next;
    {
        const FileOutput output(folder / "a.png", "write", true);
        next = folder.names().front();
    }
    const std::size_t dash = next.rfind('-');
    next = next.substr(0, dash + 1) + std::to_string(std::stoi(next.substr(dash + 1)) + 1);
    put_bytes(folder / next, "somebody else's");
    { const FileOutput output(folder / "a.png", "write", true); }
    EXPECT_EQ(folder.names(), Names{next});
    EXPECT_EQ(bytes_of(folder / next), "somebody else's");
}

TEST(file_output, keeps_the_permissions_of_the_replaced_file) {
    const TemporaryFolder folder;
    put_bytes(folder / "a", "old");
    fs::permissions(folder / "a", fs::perms{0640});
    write_file(folder / "a", "new", "write");
    EXPECT_EQ(bytes_of(folder / "a"), "new");
    EXPECT_EQ(fs::status(folder / "a").permissions(), fs::perms{0640});
}

TEST(file_output, new_files_follow_the_mask) {
    const TemporaryFolder folder;
    const mode_t before = ::umask(0027);
    write_file(folder / "a", "new", "write");
    ::umask(before);
    EXPECT_EQ(fs::status(folder / "a").permissions(), fs::perms{0640});
}

TEST(file_output, a_link_stays_a_link) {
    const TemporaryFolder folder;
    fs::create_directory(folder / "below");
    put_bytes(folder / "below/real", "old");
    fs::create_symlink("below/real", folder / "link");
    fs::create_symlink("link", folder / "twice");
    write_file(folder / "twice", "new", "write");
    EXPECT_TRUE(fs::is_symlink(folder / "link"));
    EXPECT_TRUE(fs::is_symlink(folder / "twice"));
    EXPECT_EQ(bytes_of(folder / "below/real"), "new");

    fs::create_symlink(folder / "below/absent", folder / "dangling");
    write_file(folder / "dangling", "made", "write");
    EXPECT_TRUE(fs::is_symlink(folder / "dangling"));
    EXPECT_EQ(bytes_of(folder / "below/absent"), "made");

    fs::create_symlink("round", folder / "round");
    EXPECT_TRUE(
        contains(failure([&] { write_file(folder / "round", "x", "write 'round'"); }), "write 'round': "));
    EXPECT_EQ(folder.names(), (Names{"below", "dangling", "link", "round", "twice"}));
}

TEST(file_output, devices_are_written_into) {
    const TemporaryFolder folder;
    write_file("/dev/null", "gone", "write '/dev/null'");
    EXPECT_TRUE(fs::is_character_file("/dev/null"));

    fs::create_symlink("/dev/full", folder / "full.png");
    const std::string message = failure([&] { write_file(folder / "full.png", "x", "write 'full.png'"); });
    EXPECT_TRUE(contains(message, "write 'full.png': No space left on device")) << message;
    EXPECT_TRUE(contains(message, "free some space")) << message;
    EXPECT_TRUE(fs::is_symlink(folder / "full.png"));
    EXPECT_TRUE(fs::is_character_file("/dev/full"));

    ASSERT_EQ(::mkfifo((folder / "pipe").c_str(), 0600), 0);
    const int reader = ::open((folder / "pipe").c_str(), O_RDWR | O_NONBLOCK);
    ASSERT_GE(reader, 0);
    write_file(folder / "pipe", "through", "write");
    char text[16] = {};
    EXPECT_EQ(::read(reader, text, sizeof text), 7);
    ::close(reader);
    EXPECT_STREQ(text, "through");
    EXPECT_TRUE(fs::is_fifo(folder / "pipe"));
    EXPECT_EQ(folder.names(), (Names{"full.png", "pipe"}));
}

TEST(file_output, open_files_are_written_on) {
    const TemporaryFolder folder;
    const int file = ::open((folder / "out").c_str(), O_WRONLY | O_CREAT, 0666);
    ASSERT_GE(file, 0);
    ASSERT_EQ(::write(file, "before ", 7), 7);
    const std::string name = "/dev/fd/" + std::to_string(file);
    write_file(name, "the bytes ", "write");
    fs::create_symlink("/proc/self/fd/" + std::to_string(file), folder / "link.json");
    write_file(folder / "link.json", "twice", "write");
    EXPECT_EQ(::close(file), 0);
    EXPECT_EQ(bytes_of(folder / "out"), "before the bytes twice");
    EXPECT_TRUE(contains(failure([&] { check_output(name, "write 'x'"); }), "write 'x': Bad file"));
    EXPECT_EQ(folder.names(), (Names{"link.json", "out"}));
}

TEST(file_output, refuses_what_is_no_file) {
    const TemporaryFolder folder;
    EXPECT_EQ(failure([&] { check_output(folder.path(), "write 'x'"); }),
              "write 'x': '" + folder.path().string() + "' is a folder; give a file name");
    EXPECT_EQ(failure([&] { check_output(folder / "new/", "write 'x'"); }),
              "write 'x': '" + (folder / "new/").string() + "' names a folder; give a file name");
    EXPECT_EQ(failure([&] { check_output("", "write 'x'"); }),
              "write 'x': the name is empty; give a file name");
    EXPECT_EQ(
        failure([&] { check_output(folder / "no/a.png", "write 'x'"); }),
        "write 'x': the folder '" + (folder / "no").string() + "' does not exist; make it or choose another");
    put_bytes(folder / "file", "");
    EXPECT_TRUE(
        contains(failure([&] { check_output(folder / "file/a.png", "write 'x'"); }), "does not exist"));

    const int server = ::socket(AF_UNIX, SOCK_STREAM, 0);
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    const std::string name = (folder / "socket").string();
    ASSERT_LT(name.size(), sizeof address.sun_path);
    std::memcpy(address.sun_path, name.c_str(), name.size());
    ASSERT_EQ(::bind(server, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    EXPECT_TRUE(contains(failure([&] { check_output(name, "write 'x'"); }), "is a block device or a socket"));
    ::close(server);
    EXPECT_EQ(folder.names(), (Names{"file", "socket"}));
}

TEST(file_output, long_names_are_as_good_as_short_ones) {
    const TemporaryFolder folder;
    const std::string longest = std::string(251, 'n') + ".png";
    write_file(folder / longest, "x", "write");
    EXPECT_EQ(folder.names(), Names{longest});
    const std::string message = failure([&] { write_file(folder / ("n" + longest), "x", "write"); });
    EXPECT_TRUE(contains(message, "File name too long")) << message;
    EXPECT_EQ(folder.names(), Names{longest});
}

TEST(file_output, without_permission) {
    const TemporaryFolder folder;
    fs::create_directory(folder / "closed");
    put_bytes(folder / "file", "old");
    fs::permissions(folder / "file", fs::perms{0444});
    fs::permissions(folder / "closed", fs::perms{0555});
    // The superuser may do all; this thread's rights are given up and taken back.
    const bool superuser = ::geteuid() == 0;
    if (superuser) {
        fs::permissions(folder.path(), fs::perms{0777});
        ASSERT_EQ(::seteuid(65534), 0);
    }
    const std::string in_folder = failure([&] { check_output(folder / "closed/a.png", "write 'a'"); });
    const std::string over_file = failure([&] { write_file(folder / "file", "new", "write 'a'"); });
    if (superuser) {
        ASSERT_EQ(::seteuid(0), 0);
    }
    EXPECT_TRUE(
        contains(in_folder, "Permission denied ('" + (folder / "closed").string() + "'); choose a place"))
        << in_folder;
    EXPECT_TRUE(contains(over_file, "Permission denied ('" + (folder / "file").string() + "')")) << over_file;
    EXPECT_EQ(bytes_of(folder / "file"), "old");
    EXPECT_EQ(folder.names(), (Names{"closed", "file"}));
}

TEST(file_output, a_full_disk_changes_nothing) {
    const TemporaryFolder folder;
    put_bytes(folder / "a.json", "old");
    std::string message;
    {
        const test::FullDisk disk(4096);
        message = failure([&] { write_file(folder / "a.json", std::string(5000, 'x'), "write 'a.json'"); });
    }
    EXPECT_TRUE(contains(message, "write 'a.json': File too large")) << message;
    EXPECT_EQ(bytes_of(folder / "a.json"), "old");
    EXPECT_EQ(folder.names(), Names{"a.json"});
}

TEST(file_output, check_leaves_nothing) {
    const TemporaryFolder folder;
    EXPECT_NO_THROW(check_output(folder / "a.png", "write"));
    EXPECT_TRUE(folder.names().empty());
}

}  // namespace
}  // namespace btfield
