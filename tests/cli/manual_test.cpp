// Manual pages: one for every command, all that its help says, and no fault that a linter finds.

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <regex>
#include <string>

#include "tests/cli_cases.hpp"
#include "tests/places.hpp"
#include "tests/temporary_folder.hpp"

namespace btfield {
namespace {

namespace fs = std::filesystem;
using test::btfield;
using test::bytes_of;
using test::commands;
using test::Ended;
using test::expect_failure;
using test::run_program;
using test::TemporaryFolder;
using test::text_of;
using test::Words;

std::string page_name(const Words& words) {
    std::string name = text_of(words);
    std::replace(name.begin(), name.end(), ' ', '-');
    return name + ".1";
}

/// Without the escapes of roff that letters and options have.
std::string plain(const std::string& page) {
    return std::regex_replace(std::regex_replace(page, std::regex(R"(\\f.|\\:)"), ""), std::regex(R"(\\-)"),
                              "-");
}

TEST(CliManual, EveryCommandHasAPageWithAllItsOptions) {
    const TemporaryFolder folder;
    const Ended ended = btfield({"man", "--all", folder.path().string()});
    ASSERT_EQ(ended.code, 0) << ended.err;
    const std::vector<Words> all = commands();
    EXPECT_EQ(folder.names().size(), all.size());
    for (Words words : all) {
        SCOPED_TRACE(text_of(words));
        const std::string page = plain(bytes_of(folder / page_name(words)));
        EXPECT_NE(page.find("\n.SH NAME\n" + page_name(words).substr(0, page_name(words).size() - 2) + " - "),
                  std::string::npos);
        words.emplace_back("--help");
        const std::string help = btfield(words).out;
        const std::regex option(R"(\n  (-[^ \n]+))");
        int options = 0;
        for (std::sregex_iterator i(help.begin(), help.end(), option), end; i != end; ++i, ++options) {
            const std::string names = std::regex_replace((*i)[1].str(), std::regex(","), ", ");
            EXPECT_NE(page.find("\n.TP\n" + names), std::string::npos) << names;
        }
        EXPECT_GE(options, 1);
        const std::string example = help.substr(
            help.find("\n  ") + 3, help.find('\n', help.find("\n  ") + 3) - help.find("\n  ") - 3);
        EXPECT_NE(page.find("\n" + example.substr(0, example.find("   #"))), std::string::npos) << example;
    }
    EXPECT_EQ(plain(btfield({"man", "experiment", "run"}).out),
              plain(bytes_of(folder / "btfield-experiment-run.1")));
    expect_failure({"man", "paint"}, 2, "'paint' is no command of btfield");
    expect_failure({"man", "fit", "--all", folder.path().string()}, 2, "COMMAND and --all");
}

TEST(CliManual, TheDayCanBeSet) {
    const Ended ended = run_program({"/usr/bin/env", "SOURCE_DATE_EPOCH=86400", test::command_path(), "man"});
    EXPECT_NE(ended.out.find(".TH BTFIELD 1 1970-01-02 "), std::string::npos) << ended.out.substr(0, 200);
}

TEST(CliManualLong, LintersFindNothing) {
    const TemporaryFolder folder;
    ASSERT_EQ(btfield({"man", "--all", folder.path().string()}).code, 0);
    for (const std::string& name : folder.names()) {
        const std::string page = (folder / name).string();
        const Ended mandoc = run_program({"/usr/bin/mandoc", "-T", "lint", "-W", "warning", page});
        EXPECT_EQ(mandoc.code, 0) << mandoc.out << mandoc.err;
        const Ended groff = run_program({"/usr/bin/groff", "-man", "-ww", "-z", "-Tutf8", page});
        EXPECT_EQ(groff.code, 0) << groff.err;
        EXPECT_EQ(groff.err, "");
    }
}

}  // namespace
}  // namespace btfield
