#include "btfield/version.hpp"

namespace btfield {

std::string_view version() {
    return BTFIELD_VERSION;
}

}  // namespace btfield
