#include "io/file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <string>
#include <system_error>

#include "geometry/error.h"

namespace toile {

namespace {

std::string reason() { return std::generic_category().message(errno); }

struct Descriptor {
  int fd;
  ~Descriptor() {
    if (fd >= 0) ::close(fd);
  }
};

}  // namespace

std::string read_file(const std::filesystem::path& path, std::uintmax_t limit) {
  const std::string name = path.string();
  const Descriptor file{::open(path.c_str(), O_RDONLY | O_CLOEXEC)};
  if (file.fd < 0) throw InputError(name + ": " + reason());
  struct stat status {};
  if (::fstat(file.fd, &status) != 0) throw InputError(name + ": " + reason());
  if (S_ISDIR(status.st_mode)) throw InputError(name + ": it is a directory, must be a file");
  auto too_large = [&] { return InputError(name + ": the file is larger than " + std::to_string(limit) + " bytes"); };
  if (S_ISREG(status.st_mode) && static_cast<std::uintmax_t>(status.st_size) > limit) throw too_large();

  // Pipes and growing files have no size to trust: read until the end.
  std::string bytes;
  std::size_t used = 0;
  bytes.resize(S_ISREG(status.st_mode) ? static_cast<std::size_t>(status.st_size) + 1 : std::size_t{1} << 16);
  for (;;) {
    if (used == bytes.size()) bytes.resize(2 * bytes.size());
    const ssize_t got = ::read(file.fd, bytes.data() + used, bytes.size() - used);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) throw InputError(name + ": " + reason());
    if (got == 0) break;
    used += static_cast<std::size_t>(got);
    if (used > limit) throw too_large();
  }
  bytes.resize(used);
  return bytes;
}

void write_file(const std::filesystem::path& path, std::string_view bytes) {
  const std::string name = path.string();
  std::error_code error;
  const std::filesystem::path folder = path.has_parent_path() ? path.parent_path() : std::filesystem::path(".");
  std::filesystem::create_directories(folder, error);
  if (error) throw OutputError(name + ": the folder can't be made: " + error.message());
  if (std::filesystem::is_directory(path, error)) throw OutputError(name + ": it is a directory, must be a file");

  std::string temporary = (folder / ".").string();
  temporary.append(path.filename().string()).append(".XXXXXX");
  Descriptor file{::mkstemp(temporary.data())};
  if (file.fd < 0) throw OutputError(name + ": " + reason());
  auto fail = [&]() -> OutputError {
    const std::string why = reason();
    ::unlink(temporary.c_str());
    return OutputError(name + ": " + why);
  };
  for (std::size_t written = 0; written < bytes.size();) {
    const ssize_t n = ::write(file.fd, bytes.data() + written, bytes.size() - written);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) throw fail();
    written += static_cast<std::size_t>(n);
  }
  // mkstemp gives 0600; a new file gets what the process's mask allows, an old one keeps its mode.
  struct stat old {};
  mode_t mode = 0;
  if (::stat(path.c_str(), &old) == 0) {
    mode = old.st_mode & 07777;
  } else {
    const mode_t mask = ::umask(0);
    ::umask(mask);
    mode = 0666 & ~mask;
  }
  if (::fchmod(file.fd, mode) != 0 || ::fsync(file.fd) != 0) throw fail();
  const int closed = ::close(file.fd);
  file.fd = -1;
  if (closed != 0 || ::rename(temporary.c_str(), path.c_str()) != 0) throw fail();
  const Descriptor directory{::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)};
  if (directory.fd >= 0) ::fsync(directory.fd);  // the name, too; a file system that can't is no failure
}

}  // namespace toile
