#pragma once

#include "host/base/names.hpp"

namespace btfield::cli {

/// What `completion` prints for: a shell, or the words that shells ask for.
enum class Shell { bash, zsh, fish, devices };

}  // namespace btfield::cli

namespace btfield::detail {

template <>
struct Names<cli::Shell> {
    static constexpr std::string_view what = "shell";
    static constexpr auto words = std::to_array<Word<cli::Shell>>({{cli::Shell::bash, "bash"},
                                                                   {cli::Shell::zsh, "zsh"},
                                                                   {cli::Shell::fish, "fish"},
                                                                   {cli::Shell::devices, "devices"}});
};

}  // namespace btfield::detail
