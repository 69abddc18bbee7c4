#include "host/cli/profile_text.hpp"

#include "host/cli/report.hpp"

namespace btfield::cli {

std::string ceilings_text(const Ceilings& ceilings) {
    return number_text(1e-9 * ceilings.bytes_per_second) + " GB/s of copies, " +
           number_text(1e-9 * ceilings.operations_per_second) + " G operations/s, " +
           number_text(1e6 * ceilings.launch_seconds) + " µs a launch";
}

std::string profile_text(const std::vector<ProfileEntry>& profile, const Ceilings& ceilings) {
    double all = 0.0;
    for (const ProfileEntry& entry : profile) all += entry.seconds;
    // What is not known is left empty.
    const auto rate = [](double amount, double seconds) {
        return amount > 0.0 && seconds > 0.0 ? number_text(1e-9 * amount / seconds) : std::string();
    };
    std::vector<std::vector<std::string>> rows{
        {"kernel", "launches", "milliseconds", "%", "MB", "GB/s", "G operations/s", "% of ceiling"}};
    for (const ProfileEntry& entry : profile) {
        const double share = share_of_ceiling(entry, ceilings);
        rows.push_back({entry.kernel, std::to_string(entry.launches), number_text(1e3 * entry.seconds),
                        number_text(100.0 * entry.seconds / all),
                        entry.bytes > 0.0 ? number_text(1e-6 * entry.bytes) : std::string(),
                        rate(entry.bytes, entry.seconds), rate(entry.operations, entry.seconds),
                        share > 0.0 ? number_text(100.0 * share) : std::string()});
    }
    return table(rows, "lr") + "the device reaches " + ceilings_text(ceilings) + "\n";
}

}  // namespace btfield::cli
