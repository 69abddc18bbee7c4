#pragma once

// Where the tests find things: of all their sources one alone knows, so that the others are compiled once
// for every checkout.

#include <string>

namespace btfield::test {

/// tests/data.
const std::string& data_folder();
/// Root of the checkout.
const std::string& source_folder();
/// The built command.
const std::string& command_path();
/// The shared library, by the name that programs load.
const std::string& library_path();
/// Starts programs under MPI; empty where there is none.
const std::string& mpiexec_path();

}  // namespace btfield::test
