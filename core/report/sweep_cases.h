// The cases of a sweep: a table of values, from --over and --cases.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace sim::report {

struct SweepCases {
  std::vector<std::string> names;              // integrator, dt, tol, time, steps, seed, arguments
  std::vector<std::vector<std::string>> rows;  // a value of each name

  std::size_t count() const { return rows.size(); }
  bool has(const std::string& name) const;
};

// The product of all axes, the last one fastest: "NAME=a,b,c", "NAME=LO:HI:N" for N equal steps
// from LO to HI, "NAME=LO:HI:logN" for equal factors, "NAME=LO..HI" for whole numbers. Values
// between commas that are PARAM=VALUE belong to the one before. Throws Error{kUsage}.
SweepCases product_of(const std::vector<std::string>& axes);

// A CSV file: names, then a row a case. Throws Error{kUsage}, Error{kIo}.
SweepCases cases_in(const std::string& file);
// The same if a name may occur twice, as in the table of a sweep over steps: the first one counts.
SweepCases table_in(const std::string& file);

}  // namespace sim::report
