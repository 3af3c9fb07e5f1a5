#include "core/base/system_failure.h"

#include <cerrno>

namespace sim {

bool is_machine_failure(int error) {
  switch (error) {
    case ENOMEM:
    case EAGAIN:
    case EMFILE:
    case ENFILE:
    case EIO:
    case ENOSPC:
    case EDQUOT:
    case ESTALE:
      return true;
    default:
      return false;
  }
}

std::string remedy_for(int error) {
  switch (error) {
    case ENOMEM:
      return "give it more memory";
    case EAGAIN:
      return "allow more processes or threads (ulimit -u)";
    case EMFILE:
      return "allow more open files (ulimit -n)";
    case ENFILE:
      return "end what holds so many files open on this machine";
    case EIO:
    case ESTALE:
      return "check the disk, or the network that it is on";
    case ENOSPC:
    case EDQUOT:
      return "make room there";
    case EACCES:
    case EPERM:
      return "check its permissions";
    case ENOENT:
    case ENOTDIR:
      return "check its name";
    default:
      return "";
  }
}

std::string remedy_for_writing(int error) {
  const bool limit = error == EMFILE || error == ENFILE || error == ENOMEM || error == EAGAIN;
  return limit ? remedy_for(error) : "check the folder, its permissions and the space there";
}

}  // namespace sim
