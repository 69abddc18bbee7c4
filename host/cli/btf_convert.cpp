#include <memory>
#include <string>

#include "host/base/text.hpp"
#include "host/cli/btf_parts.hpp"
#include "host/cli/command_text.hpp"
#include "host/cli/options.hpp"
#include "host/cli/report.hpp"

namespace btfield::cli {
namespace {

struct ConvertArguments {
    std::string set;
    BtfOptions reading;
    BtfWritingArguments writing;
    bool json = false;
};

void run_convert(const ConvertArguments& given) {
    const Stopwatch total;
    ConvertArguments options = given;
    const BtfSet set = open_told(options.set, options.reading);
    check_btf_writing(options.writing, {options.set}, set.description());
    const BtfWriteReport report = write_told(options.writing, set);
    if (options.json) {
        Json object = set_json(set);
        object["format"] = std::string(name(options.writing.how.format));
        object["bytes"] = report.bytes;
        object["output"] = options.writing.output;
        object["exposure"] = number(options.writing.how.exposure);
        object["clamped_pixels"] = report.clamped_pixels;
        put_components(report, object);
        object["seconds"]["total"] = total.seconds();
        emit_json(object);
        return;
    }
    std::string text = "wrote " + options.writing.output + ": " +
                       detail::counted(report.pictures, "picture") + " of " + detail::text_of(set.size()) +
                       " pixels, as " + std::string(name(options.writing.how.format)) + ", in " +
                       seconds_text(total.seconds()) + "\n";
    text += components_text(report);
    if (report.clamped_pixels > 0)
        text += detail::counted(report.clamped_pixels, "pixel") +
                " are brighter than white or below black and were clamped; a lower --exposure or --type half "
                "keeps them.\n";
    emit_result(text);
}

}  // namespace

void add_btf_convert(CLI::App& parent, Action& action) {
    CLI::App* command = parent.add_subcommand("convert", "write a BTF, or part of it, in another format");
    const auto options = std::make_shared<ConvertArguments>();
    command->add_option("SET", options->set, "a BTF (docs/btf.md)")->required()->type_name("");
    add_btf_writing(*command, options->writing);
    add_btf_reading(*command, options->reading);
    add_json(*command, options->json);
    set_guide(
        *command,
        {.usual = {{"btfield btf convert set/ -o set.tbig"}},
         .more = {{"btfield btf convert carpet.btf -o carpet/ --type half"},
                  {"btfield btf convert set/ -o set.btf --components 100"},
                  {"btfield btf convert set/ -o few/ --view-stride 3 --light-stride 3"}},
         .notes = {"Light stays what it is: numbers are made linear and then coded as the format has them. "
                   "Directions that were moved out of the viewer's way keep their true angle."}});
    command->callback([options, &action] { action = [options] { run_convert(*options); }; });
}

}  // namespace btfield::cli
