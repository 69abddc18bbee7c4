// FIPS 180-4 by the vectors that NIST publishes (CAVP, SHA256ShortMsg and the standard's examples).

#include "host/experiment/sha256.hpp"

#include <gtest/gtest.h>

#include <string>

#include "btfield/error.hpp"
#include "tests/temporary_folder.hpp"

namespace btfield {

using namespace detail;

namespace {

TEST(Sha256, PublishedVectors) {
    EXPECT_EQ(sha256(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
    EXPECT_EQ(sha256("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
    EXPECT_EQ(sha256("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq"),
              "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
    EXPECT_EQ(sha256(std::string(1'000'000, 'a')),
              "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

TEST(Sha256, PiecesMakeTheWhole) {
    std::string text;
    for (int i = 0; i < 300; ++i) text += static_cast<char>(i * 7);
    for (const std::size_t piece : {1U, 3U, 55U, 56U, 63U, 64U, 65U, 128U}) {
        Sha256 hash;
        for (std::size_t at = 0; at < text.size(); at += piece)
            hash.add(std::string_view(text).substr(at, piece));
        EXPECT_EQ(hash.digest(), sha256(text)) << piece;
    }
}

TEST(Sha256, File) {
    const test::TemporaryFolder folder;
    const std::string bytes(200'000, 'x');
    test::put_bytes(folder / "file", bytes);
    EXPECT_EQ(sha256_of_file(folder / "file"), sha256(bytes));
    EXPECT_THROW(static_cast<void>(sha256_of_file(folder / "absent")), InputError);
    EXPECT_THROW(static_cast<void>(sha256_of_file(folder.path())), InputError);
}

}  // namespace
}  // namespace btfield
