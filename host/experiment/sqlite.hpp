#pragma once

/// \file
/// SQLite with errors that say what happened to the file. No other file speaks its interface.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

struct sqlite3;
struct sqlite3_stmt;

namespace btfield::detail {

class Statement;

class Connection {
  public:
    enum class Access { create, write, read };
    /// \param asked first part of the messages, such as "read the results 'a.db'"
    Connection(const std::filesystem::path& path, Access access, std::string asked);
    ~Connection();
    Connection(const Connection&) = delete;
    Connection& operator=(const Connection&) = delete;

    /// Any number of statements without values.
    void execute(const char* statements);
    [[nodiscard]] std::int64_t number(const char* query);
    [[nodiscard]] const std::string& asked() const { return asked_; }
    /// Throws what the last call on the connection ran into.
    [[noreturn]] void fail() const;

  private:
    friend class Statement;
    void close() noexcept;
    std::string asked_;
    sqlite3* handle_ = nullptr;
};

/// All changes until commit(), or none of them.
class Transaction {
  public:
    /// A read transaction sees one state of the database, whatever others write meanwhile.
    enum class Kind { write, read };
    explicit Transaction(Connection& connection, Kind kind = Kind::write);
    ~Transaction();
    Transaction(const Transaction&) = delete;
    Transaction& operator=(const Transaction&) = delete;
    void commit();

  private:
    Connection& connection_;
    bool open_ = true;
};

/// Values are bound in the order of the statement's question marks, columns read from 0.
class Statement {
  public:
    Statement(Connection& connection, std::string_view text);
    ~Statement();
    Statement(const Statement&) = delete;
    Statement& operator=(const Statement&) = delete;

    Statement& bind(std::string_view text);
    Statement& bind(double value);  ///< NaN becomes NULL
    Statement& bind_number(std::int64_t value);
    Statement& bind_null();
    template <class Value>
    Statement& bind(const std::optional<Value>& value) {
        if (!value) return bind_null();
        if constexpr (std::is_integral_v<Value>) {
            return bind_number(static_cast<std::int64_t>(*value));
        } else {
            return bind(*value);
        }
    }
    /// True while there is a row.
    bool step();
    /// Steps to the end and makes the statement ready for other values.
    void run();

    [[nodiscard]] std::string text(int column) const;
    [[nodiscard]] double real(int column) const;  ///< NaN for NULL
    [[nodiscard]] std::int64_t number(int column) const;
    [[nodiscard]] bool is_null(int column) const;

  private:
    Connection& connection_;
    sqlite3_stmt* handle_ = nullptr;
    int bound_ = 0;
};

}  // namespace btfield::detail
