#include "host/experiment/sqlite.hpp"

#include <sqlite3.h>

#include <cmath>
#include <limits>
#include <utility>

#include "btfield/error.hpp"

namespace btfield::detail {
namespace {

namespace fs = std::filesystem;

constexpr int patience =
    30'000;  // milliseconds that a reader waits for a checkpoint, and the other way round

/// "file:" name that cannot be mistaken for options.
std::string uri(const fs::path& path, const char* options) {
    std::string text = "file:";
    for (const char c : fs::absolute(path).string()) {
        constexpr std::string_view special = "%?#";
        if (special.find(c) == std::string_view::npos) {
            text += c;
        } else {
            constexpr std::string_view digits = "0123456789abcdef";
            const auto byte = static_cast<unsigned char>(c);
            text += {'%', digits[byte >> 4U], digits[byte & 15U]};
        }
    }
    return text + options;
}

}  // namespace

Connection::Connection(const fs::path& path, Access access, std::string asked) : asked_(std::move(asked)) {
    // Readers may write too, as SQLite sees it: only who may removes the log's files when the last one
    // leaves.
    const int flags = SQLITE_OPEN_URI | SQLITE_OPEN_EXRESCODE | SQLITE_OPEN_NOMUTEX | SQLITE_OPEN_READWRITE |
                      (access == Access::create ? SQLITE_OPEN_CREATE : 0);
    std::error_code error;
    if (access != Access::create && !fs::exists(path, error)) {
        throw InputError(asked_, "there is no such file", "give the database of an experiment");
    }
    if (fs::is_directory(path, error)) throw InputError(asked_, "it is a folder", "give the name of a file");
    const auto open = [&](const char* options) {
        const int code = sqlite3_open_v2(uri(path, options).c_str(), &handle_, flags, nullptr);
        if (code == SQLITE_OK) sqlite3_busy_timeout(handle_, patience);
        // Reads the header: opening alone does not look at the file.
        return code == SQLITE_OK ? sqlite3_exec(handle_, "PRAGMA schema_version", nullptr, nullptr, nullptr)
                                 : code;
    };
    int code = open("");
    if ((code & 0xff) == SQLITE_CANTOPEN && access == Access::read &&
        !fs::exists(path.string() + "-wal", error)) {
        // In a folder without write permission SQLite cannot make the files that readers of a log share.
        close();
        code = open("?immutable=1");
    }
    try {
        if (code != SQLITE_OK) fail();
        if (access == Access::read) execute("PRAGMA query_only = 1");
    } catch (...) {
        close();
        throw;
    }
}

Connection::~Connection() {
    close();
}

void Connection::close() noexcept {
    sqlite3_close_v2(std::exchange(handle_, nullptr));
}

void Connection::fail() const {
    const int code = handle_ != nullptr ? sqlite3_extended_errcode(handle_) : SQLITE_NOMEM;
    const std::string found =
        handle_ != nullptr ? std::string(sqlite3_errmsg(handle_)) : std::string("out of memory");
    switch (code & 0xff) {
        case SQLITE_NOTADB:
            throw InputError(asked_, "the file is no SQLite database", "give the database of an experiment");
        case SQLITE_CORRUPT:
            throw InputError(asked_, "the database is damaged (" + found + ")",
                             "restore it from a copy, or run the experiment into a new one");
        case SQLITE_FULL:
        case SQLITE_IOERR:
            throw InputError(asked_, found + " (is the disk full?)",
                             "free some space; all committed results are safe, and the same command resumes");
        case SQLITE_READONLY:
        case SQLITE_CANTOPEN:
        case SQLITE_PERM:
            throw InputError(asked_, found, "choose a place that you may write to");
        case SQLITE_BUSY:
        case SQLITE_LOCKED:
            throw InputError(asked_, "another program keeps the database locked",
                             "wait for it to end, or choose another file");
        default:
            throw InputError(asked_, found, "give the database of an experiment");
    }
}

void Connection::execute(const char* statements) {
    if (sqlite3_exec(handle_, statements, nullptr, nullptr, nullptr) != SQLITE_OK) fail();
}

std::int64_t Connection::number(const char* query) {
    Statement statement(*this, query);
    return statement.step() ? statement.number(0) : 0;
}

Transaction::Transaction(Connection& connection, Kind kind) : connection_(connection) {
    connection_.execute(kind == Kind::write ? "BEGIN IMMEDIATE" : "BEGIN");
}

Transaction::~Transaction() {
    if (!open_) return;
    try {
        connection_.execute("ROLLBACK");
    } catch (...) {  // SQLite has rolled back already
        open_ = false;
    }
}

void Transaction::commit() {
    connection_.execute("COMMIT");
    open_ = false;
}

Statement::Statement(Connection& connection, std::string_view text) : connection_(connection) {
    if (sqlite3_prepare_v2(connection_.handle_, text.data(), static_cast<int>(text.size()), &handle_,
                           nullptr) != SQLITE_OK) {
        connection_.fail();
    }
}

Statement::~Statement() {
    sqlite3_finalize(handle_);
}

Statement& Statement::bind(std::string_view text) {
    const char* data = text.data() != nullptr ? text.data() : "";
    sqlite3_bind_text(handle_, ++bound_, data, static_cast<int>(text.size()), SQLITE_TRANSIENT);
    return *this;
}

Statement& Statement::bind(double value) {
    sqlite3_bind_double(handle_, ++bound_, value);
    return *this;
}

Statement& Statement::bind_number(std::int64_t value) {
    sqlite3_bind_int64(handle_, ++bound_, value);
    return *this;
}

Statement& Statement::bind_null() {
    sqlite3_bind_null(handle_, ++bound_);
    return *this;
}

bool Statement::step() {
    const int code = sqlite3_step(handle_);
    if (code == SQLITE_ROW) return true;
    if (code != SQLITE_DONE) connection_.fail();
    return false;
}

void Statement::run() {
    while (step()) {
    }
    sqlite3_reset(handle_);
    bound_ = 0;
}

std::string Statement::text(int column) const {
    const unsigned char* text = sqlite3_column_text(handle_, column);
    const auto bytes = static_cast<std::size_t>(sqlite3_column_bytes(handle_, column));
    return text == nullptr ? std::string() : std::string(reinterpret_cast<const char*>(text), bytes);
}

double Statement::real(int column) const {
    return is_null(column) ? std::numeric_limits<double>::quiet_NaN()
                           : sqlite3_column_double(handle_, column);
}

std::int64_t Statement::number(int column) const {
    return sqlite3_column_int64(handle_, column);
}

bool Statement::is_null(int column) const {
    return sqlite3_column_type(handle_, column) == SQLITE_NULL;
}

}  // namespace btfield::detail
