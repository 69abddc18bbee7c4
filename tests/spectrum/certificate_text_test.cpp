// host/spectrum/certificate_text.hpp.

#include "host/spectrum/certificate_text.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "host/spectrum/examination.hpp"

namespace btfield::detail {
namespace {

TEST(CertificateText, NamesWhatFails) {
    Certificate certificate;
    certificate.min_singular = 0.1;
    certificate.variance_ratio = {1.0, largest_variance_ratio};
    EXPECT_EQ(failure_text(certificate), "det Λ comes too close to zero to prove that it has none");
    certificate.variance_ratio[1] = 14.25;
    EXPECT_EQ(failure_text(certificate), "the variance of plane 2 is 14.25 times the picture's");
    certificate.variance_ratio[0] = 0.0;
    EXPECT_EQ(failure_text(certificate), "the variance of plane 1 is 0 times the picture's");
    certificate.variance_ratio[0] = std::numeric_limits<double>::quiet_NaN();
    EXPECT_EQ(failure_text(certificate), "the variance of plane 1 is not finite");
    certificate.min_singular = -0.1;
    EXPECT_EQ(failure_text(certificate), "Λ is not positive definite");
    certificate.zeros = 1;
    EXPECT_EQ(failure_text(certificate), "1 zero of det Λ");
    certificate.zeros = 12;
    EXPECT_EQ(failure_text(certificate), "12 zeros of det Λ");
}

}  // namespace
}  // namespace btfield::detail
