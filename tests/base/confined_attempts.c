/* What a foreign FMU tries in its confinement: each attempt that succeeds adds its number; HOME and PORT are macros. */
#include <arpa/inet.h>
#include <fcntl.h>
#include <signal.h>
#include <stdio.h>
#include <sys/socket.h>
#include <sys/un.h>
static double did;
static int opens(const char *path, int flags) {
  int file = open(path, flags, 0600);
  if (file >= 0) close(file);
  return file >= 0;
}
static int connects(void) {
  struct sockaddr_in to = {.sin_family = AF_INET, .sin_port = htons(PORT), .sin_addr.s_addr = htonl(INADDR_LOOPBACK)};
  int s = socket(AF_INET, SOCK_STREAM, 0);
  return s >= 0 && connect(s, (struct sockaddr *)&to, sizeof to) == 0;
}
static int own(const char *folder) {
  char path[4096];
  snprintf(path, sizeof path, "%s/own", folder);
  return opens(path, O_CREAT | O_RDWR) && opens(path, O_RDONLY) && unlink(path) == 0;
}
static void attempts(void) {
  static int n;
  if (n++) return;
  did += 1 * opens(HOME "/stolen", O_CREAT | O_WRONLY);
  did += 2 * connects();
  did += 4 * opens(HOME "/secret", O_RDONLY);
  did += 8 * (truncate(HOME "/secret", 1) == 0);
  did += 16 * (socket(AF_UNIX, SOCK_STREAM, 0) >= 0);
  did += 32 * (system("echo > " HOME "/by_another") == 0);
  did += 64 * (rename(HOME "/moved", HOME "/away") == 0);
  did += 128 * own(".");
  did += 256 * own(getenv("TMPDIR"));
  did += 512 * opens("/dev/null", O_WRONLY);
}
