// The program's advice for each error number of the system.
#include "core/base/system_failure.h"

#include <catch2/catch.hpp>
#include <cerrno>

TEST_CASE(
    "each error of the system has its remedy, and limits keep theirs where files are written") {
  struct Known {
    int error;
    bool machine, limit;  // the machine's doing; a limit of this process or machine
    const char* remedy;
  };
  const Known all[] = {
      {ENOMEM, true, true, "give it more memory"},
      {EAGAIN, true, true, "allow more processes or threads (ulimit -u)"},
      {EMFILE, true, true, "allow more open files (ulimit -n)"},
      {ENFILE, true, true, "end what holds so many files open on this machine"},
      {EIO, true, false, "check the disk, or the network that it is on"},
      {ESTALE, true, false, "check the disk, or the network that it is on"},
      {ENOSPC, true, false, "make room there"},
      {EDQUOT, true, false, "make room there"},
      {EACCES, false, false, "check its permissions"},
      {EPERM, false, false, "check its permissions"},
      {ENOENT, false, false, "check its name"},
      {ENOTDIR, false, false, "check its name"},
      {EINVAL, false, false, ""},
  };
  for (const Known& each : all) {
    INFO(each.error);
    CHECK(sim::is_machine_failure(each.error) == each.machine);
    CHECK(sim::remedy_for(each.error) == each.remedy);
    CHECK(sim::remedy_for_writing(each.error) ==
          (each.limit ? each.remedy : "check the folder, its permissions and the space there"));
  }
}
