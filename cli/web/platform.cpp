// Calls of the system that WebAssembly's C library does not have. Their callers know machines on
// which they fail, and go on without them.
#include <pthread.h>
#include <sys/random.h>
#include <sys/types.h>

#include <cerrno>
#include <cstdio>
#include <ctime>

extern "C" {

int renameat2(int, const char*, int, const char*, unsigned) {
  errno = ENOSYS;
  return -1;
}

int memfd_create(const char*, unsigned) {
  errno = ENOSYS;
  return -1;
}

int prctl(int, ...) {
  errno = ENOSYS;
  return -1;
}

ssize_t getrandom(void*, size_t, unsigned) {
  errno = ENOSYS;
  return -1;
}

int pthread_getcpuclockid(pthread_t, clockid_t*) { return ENOSYS; }

}  // extern "C"
