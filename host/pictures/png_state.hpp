#pragma once

// libpng's state, whose failures leave by longjmp().

#include <png.h>

#include <array>
#include <csetjmp>
#include <cstdio>
#include <cstring>
#include <string>
#include <string_view>

namespace btfield::detail {

/// What fails in libpng leaves by longjmp() to run(): it is called in there alone, from steps that hold no
/// object with a destructor. Getters cannot fail.
class Png {
  public:
    enum class Use { read, write };
    explicit Png(Use use)
        : use_(use),
          png_(use == Use::read
                   ? png_create_read_struct(PNG_LIBPNG_VER_STRING, this, &leave, &keep_warning)
                   : png_create_write_struct(PNG_LIBPNG_VER_STRING, this, &leave, &keep_warning)),
          info_(png_create_info_struct(png_)) {}
    ~Png() {
        if (use_ == Use::read) {
            png_destroy_read_struct(&png_, &info_, nullptr);
        } else {
            png_destroy_write_struct(&png_, &info_);
        }
    }
    Png(const Png&) = delete;
    Png& operator=(const Png&) = delete;

    /// \return whether the step came to its end; otherwise message() says why
    template <class Work>
    [[nodiscard]] bool run(void (*step)(png_structp, png_infop, Work&), Work& work) {
        if (png_ == nullptr || info_ == nullptr) return false;
        if (setjmp(png_jmpbuf(png_)) != 0) return false;
        step(png_, info_, work);
        return true;
    }
    [[nodiscard]] std::string message() const {
        return message_.front() == '\0' ? "libpng cannot begin" : message_.data();
    }
    /// What libpng complained about last without giving up; empty: nothing.
    [[nodiscard]] std::string warning() const { return warning_.data(); }
    [[nodiscard]] png_structp state() const { return png_; }
    [[nodiscard]] png_infop info() const { return info_; }

  private:
    using Message = std::array<char, 160>;

    [[noreturn]] static void leave(png_structp png, png_const_charp message) {
        auto& kept = static_cast<Png*>(png_get_error_ptr(png))->message_;
        std::snprintf(kept.data(), kept.size(), "%s", message);
        png_longjmp(png, 1);
    }
    /// libpng would print it.
    static void keep_warning(png_structp png, png_const_charp message) {
        auto& kept = static_cast<Png*>(png_get_error_ptr(png))->warning_;
        std::snprintf(kept.data(), kept.size(), "%s", message);
    }

    Message message_{}, warning_{};
    Use use_;
    png_structp png_;
    png_infop info_;
};

/// Bytes come from memory: what is read goes from the beginning of `rest`.
inline void read_png_from(png_structp png, std::string_view& rest) {
    png_set_read_fn(png, &rest, [](png_structp state, png_bytep to, std::size_t count) {
        auto& from = *static_cast<std::string_view*>(png_get_io_ptr(state));
        if (count > from.size()) png_error(state, "it ends early");
        std::memcpy(to, from.data(), count);
        from.remove_prefix(count);
    });
}

}  // namespace btfield::detail
