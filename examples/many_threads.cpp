// Textures for several threads, as a server or a renderer asks for them: many_threads PICTURE SECONDS
//
// One device and one synthesiser serve all threads. A StopScope in each ends its work when time is up, in the
// middle of whatever it asked btfield for; a program with a window would ask its button.
#include <atomic>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <stop_token>
#include <thread>
#include <vector>

#include "btfield/error.hpp"
#include "btfield/fit.hpp"
#include "btfield/image_io.hpp"
#include "btfield/stop.hpp"
#include "btfield/synthesis.hpp"

namespace {

/// Textures of other and other seeds until it is told to stop.
void grow(const std::stop_token& token, btfield::Synthesiser& synthesiser, std::atomic<std::uint64_t>& seeds,
          std::atomic<int>& textures) {
    const btfield::StopScope scope([token] { return token.stop_requested(); });
    try {
        for (;;) {
            const btfield::Image texture = synthesiser.synthesise(seeds++);
            if (texture.planes() > 0) ++textures;  // here it would be sent or drawn
        }
    } catch (const btfield::Stopped&) {
        // As asked.
    } catch (const std::exception& error) {
        std::fprintf(stderr, "%s\n", error.what());
    }
}

void run(const char* path, double seconds) {
    const btfield::Picture picture = btfield::read_picture(path);
    btfield::Device device;
    const btfield::TextureModel model = btfield::fit(device, picture.image);
    btfield::Synthesiser synthesiser(device, model, {256, 256});
    std::atomic<std::uint64_t> seeds{0};
    std::atomic<int> textures{0};
    {
        constexpr int count = 4;
        std::vector<std::jthread> threads;  // which ask to stop, and wait, when they end
        threads.reserve(count);
        for (int t = 0; t < count; ++t)
            threads.emplace_back(
                [&](const std::stop_token& token) { grow(token, synthesiser, seeds, textures); });
        std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
    }
    std::printf("%d textures of 256 x 256 by 4 threads in %.1f s\n", textures.load(), seconds);
    if (textures == 0) throw btfield::InputError("grow textures", "there was no time", "give more seconds");
}

}  // namespace

int main(int count, char** arguments) {
    if (count != 3) {
        std::fprintf(stderr, "usage: many_threads PICTURE SECONDS\n");
        return 2;
    }
    try {
        run(arguments[1], std::atof(arguments[2]));
        return 0;
    } catch (const btfield::Error& error) {
        std::fprintf(stderr, "%s\n", error.what());
        return 1;
    }
}
