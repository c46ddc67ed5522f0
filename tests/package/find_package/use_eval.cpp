#include <farfield/eval/run_report.hpp>

#include <cstdio>
#include <string>

// The report of a run that measured nothing; that this links is the point.
int main() {
    const std::string report = farfield::eval::to_json(farfield::RunReport());
    std::printf("%s\n", report.c_str());
    return report.empty() ? 1 : 0;
}
