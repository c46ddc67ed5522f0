#include "support/random.hpp"
#include <farfield/eval/log_histogram.hpp>
#include <farfield/eval/run_report.hpp>

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

namespace {

using farfield::LogHistogram;
namespace eval = farfield::eval;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

std::size_t only_bin(double value) {
    LogHistogram histogram;
    histogram.add(value);
    const auto bins = histogram.bins();
    REQUIRE(std::count(bins.begin(), bins.end(), 1U) == 1);
    return static_cast<std::size_t>(std::find(bins.begin(), bins.end(), 1U) - bins.begin());
}

} // namespace

TEST_CASE("an empty histogram has no figures", "[log_histogram]") {
    LogHistogram histogram;
    CHECK(histogram.count() == 0);
    CHECK(histogram.bins().empty());
    CHECK_FALSE(histogram.max().has_value());
    CHECK_FALSE(histogram.percentile(0.5).has_value());
    histogram.add(LogHistogram{});
    CHECK(histogram == LogHistogram{});
}

TEST_CASE("every value lies in the bin whose edges hold it", "[log_histogram]") {
    CHECK(LogHistogram::lower_edge(0) == 0.0);
    CHECK(LogHistogram::lower_edge(1) == 1.0 / 1024.0);
    CHECK(LogHistogram::lower_edge(LogHistogram::kBins - 1) == 16384.0);
    for (std::size_t bin = 1; bin < LogHistogram::kBins; ++bin) {
        const double edge = LogHistogram::lower_edge(bin);
        REQUIRE(edge > LogHistogram::lower_edge(bin - 1));
        REQUIRE(only_bin(edge) == bin);
        REQUIRE(only_bin(std::nextafter(edge, 0.0)) == bin - 1);
        if (bin > 1) {
            const double width = edge - LogHistogram::lower_edge(bin - 1);
            REQUIRE(width <= LogHistogram::lower_edge(bin - 1) / 128.0);
        }
    }
    CHECK(only_bin(0.0) == 0);
    CHECK(only_bin(std::numeric_limits<double>::denorm_min()) == 0);
    CHECK(only_bin(1e300) == LogHistogram::kBins - 1);
    CHECK(only_bin(kInfinity) == LogHistogram::kBins - 1);
}

TEST_CASE("percentiles are those of the samples, to within a bin", "[log_histogram]") {
    farfield::support::Random random(20);
    for (const unsigned count : {1U, 2U, 3U, 10U, 999U, 20'000U}) {
        LogHistogram histogram;
        std::vector<double> samples;
        for (unsigned i = 0; i < count; ++i) {
            samples.push_back(std::exp2(random.uniform(-12.0, 13.9)));
            histogram.add(samples.back());
        }
        CHECK(histogram.count() == count);
        CHECK(histogram.max() == *std::max_element(samples.begin(), samples.end()));
        std::sort(samples.begin(), samples.end());
        for (const double fraction : {0.0, 0.01, 0.25, 0.5, 0.77, 0.99, 1.0}) {
            CAPTURE(count, fraction);
            const double exact = eval::percentile(samples, fraction);
            // Between two samples the wider of both bins counts: that of the upper sample.
            const auto upper = static_cast<std::size_t>(std::ceil(fraction * (count - 1)));
            const double width = std::max(samples[upper] / 128.0, 1.0 / 1024.0);
            CHECK(std::abs(*histogram.percentile(fraction) - exact) <= width);
        }
    }
}

TEST_CASE("large and infinite samples are told as they are", "[log_histogram]") {
    LogHistogram histogram;
    histogram.add(1.0);
    histogram.add(1.0);
    histogram.add(kInfinity);
    CHECK(*histogram.percentile(0.5) == Approx(1.0).epsilon(1.0 / 128.0));
    CHECK(histogram.percentile(1.0) == kInfinity);
    CHECK(histogram.percentile(0.75) == kInfinity);
    CHECK(histogram.max() == kInfinity);
    LogHistogram far;
    far.add(20'000.0);
    far.add(90'000.0);
    CHECK(far.percentile(0.0) == 90'000.0); // beyond the bins: the largest
    CHECK(far.max() == 90'000.0);
}

TEST_CASE("histograms add up", "[log_histogram]") {
    farfield::support::Random random(21);
    LogHistogram all;
    LogHistogram odd;
    LogHistogram even;
    for (int i = 0; i < 1000; ++i) {
        const double value = random.uniform(0.0, 40.0);
        all.add(value);
        (i % 2 == 0 ? even : odd).add(value);
    }
    odd.add(even);
    CHECK(odd == all);
    LogHistogram copy;
    copy.add(all);
    CHECK(copy == all);
}
