#define BTFIELD_INSTANTIATE
#include "host/base/eigen.hpp"
