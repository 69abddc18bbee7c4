// All benchmarks with their peers in one run: a table on stdout, JSON beside the executable.
#include <algorithm>
#include <cstdio>
#include <string>
#include <vector>

#include "bench/cases.hpp"
#include "bench/report.hpp"

int main(int count, char** arguments) {
    // Defaults first: what the caller says later wins.
    std::vector<std::string> words{arguments[0],
                                   "--benchmark_repetitions=9",
                                   "--benchmark_min_time=0.1",
                                   "--benchmark_enable_random_interleaving=true",
                                   "--benchmark_out=" BTFIELD_BENCH_OUTPUT,
                                   "--benchmark_out_format=json"};
    words.insert(words.end(), arguments + 1, arguments + count);
    std::vector<char*> pointers;
    std::ranges::transform(words, std::back_inserter(pointers),
                           [](std::string& word) { return word.data(); });
    int words_count = static_cast<int>(pointers.size());
    benchmark::Initialize(&words_count, pointers.data());
    if (benchmark::ReportUnrecognizedArguments(words_count, pointers.data())) return 2;

    int status = 0;
    try {
        btfield::bench::add_all();
        btfield::bench::Table table;
        benchmark::RunSpecifiedBenchmarks(&table);
    } catch (const std::exception& error) {
        std::fprintf(stderr, "%s\n", error.what());
        status = 1;
    }
    // Before static destructors run: the OpenCL driver has its own.
    benchmark::ClearRegisteredBenchmarks();
    btfield::bench::close_device();
    return status;
}
