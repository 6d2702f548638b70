/* SPDX-License-Identifier: BSD-3-Clause */
/* The platform by POSIX, with what Linux, the C library of GNU and macOS have beyond it, and without what WebAssembly
 * lacks. The side of macOS was never run. Programs have no identity there, so that no result is cached. */
#include "platform/platform.h"
#include <dirent.h>
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <sched.h>
#include <signal.h>
#include <spawn.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>
#ifdef __GLIBC__
#include <malloc.h>
#endif
#ifdef __linux__
#include <elf.h>
#include <link.h>
#endif
#ifdef __APPLE__
#include <crt_externs.h>
#include <mach-o/dyld.h>
#include <sys/sysctl.h>
#endif

/* -- paths ------------------------------------------------------------------------------------------- */

bool kmp_is_separator(char c)
{
    return c == '/';
}

size_t kmp_path_folder(const char *path)
{
    const char *slash = strrchr(path, '/');
    return slash ? (size_t)(slash - path) + 1 : 0;
}

const char *kmp_path_name(const char *path)
{
    return path + kmp_path_folder(path);
}

bool kmp_path_is_whole(const char *path)
{
    return path[0] == '/';
}

/* Copies a path that fits. */
static bool keep_path(char to[KMP_PATH_MOST], const char *path)
{
    size_t length = strlen(path);
    if (length >= KMP_PATH_MOST) {
        errno = ENAMETOOLONG;
        return false;
    }
    memcpy(to, path, length + 1);
    return true;
}

bool kmp_path_real(const char *path, char real[KMP_PATH_MOST])
{
    char *found = realpath(path, NULL);
    bool kept = found && keep_path(real, found);
    free(found);
    return kept;
}

bool kmp_path_of_command(char path[KMP_PATH_MOST])
{
#ifdef __APPLE__
    char given[KMP_PATH_MOST];
    uint32_t size = sizeof given;
    return _NSGetExecutablePath(given, &size) == 0 && kmp_path_real(given, path);
#else
    ssize_t length = readlink("/proc/self/exe", path, KMP_PATH_MOST - 1);
    path[length > 0 ? length : 0] = '\0';
    return length > 0;
#endif
}

void kmp_path_temporary(char path[KMP_PATH_MOST])
{
    const char *given = getenv("TMPDIR");
    if (!given || !*given || !keep_path(path, given))
        (void)keep_path(path, "/tmp");
}

void kmp_path_cache(char path[KMP_PATH_MOST])
{
    const char *cache = getenv("XDG_CACHE_HOME"), *home = getenv("HOME");
    int length = 0;
    if (cache && cache[0] == '/') /* a relative path does not count */
        length = snprintf(path, KMP_PATH_MOST, "%s/kempe", cache);
    else if (home && *home)
        length = snprintf(path, KMP_PATH_MOST, "%s/.cache/kempe", home);
    if (length <= 0 || length >= KMP_PATH_MOST)
        path[0] = '\0';
}

const char *kmp_environment(const char *name)
{
    return getenv(name);
}

/* -- files ------------------------------------------------------------------------------------------- */

static bool take_state(bool known, const struct stat *about, kmp_path_state *state)
{
    if (!known)
        return false;
#ifdef __APPLE__
    const struct timespec changed = about->st_mtimespec;
#else
    const struct timespec changed = about->st_mtim;
#endif
    *state = (kmp_path_state){
        .kind = S_ISREG(about->st_mode)    ? KMP_PATH_FILE
                : S_ISDIR(about->st_mode)  ? KMP_PATH_FOLDER
                : S_ISFIFO(about->st_mode) ? KMP_PATH_PIPE
                                           : KMP_PATH_OTHER,
        .size = (uint64_t)about->st_size,
        .device = (uint64_t)about->st_dev,
        .number = (uint64_t)about->st_ino,
        .changed = (int64_t)changed.tv_sec,
        .changed_ns = changed.tv_nsec,
        .permissions = about->st_mode & 07777,
        .own = S_ISREG(about->st_mode) && about->st_uid == geteuid() && !(about->st_mode & (S_IWGRP | S_IWOTH)),
    };
    return true;
}

bool kmp_path_look(const char *path, kmp_path_state *state)
{
    struct stat about;
    return take_state(stat(path, &about) == 0, &about, state);
}

bool kmp_path_look_here(const char *path, kmp_path_state *state)
{
    struct stat about;
    return take_state(lstat(path, &about) == 0, &about, state);
}

bool kmp_file_look(int file, kmp_path_state *state)
{
    struct stat about;
    return take_state(fstat(file, &about) == 0, &about, state);
}

bool kmp_path_exists(const char *path)
{
    return access(path, F_OK) == 0;
}

bool kmp_path_readable(const char *path)
{
    return access(path, R_OK) == 0;
}

int kmp_file_open(const char *path, unsigned how)
{
    int flags = O_CLOEXEC | (how & (KMP_OPEN_WRITE | KMP_OPEN_APPEND) ? O_WRONLY : O_RDONLY);
    flags |= how & KMP_OPEN_APPEND ? O_APPEND : 0;
    flags |= how & KMP_OPEN_CREATE ? O_CREAT : 0;
    flags |= how & KMP_OPEN_NEW ? O_CREAT | O_EXCL : 0;
    flags |= how & KMP_OPEN_AT_ONCE ? O_NONBLOCK : 0;
    flags |= how & KMP_OPEN_NO_LINK ? O_NOFOLLOW : 0;
    return open(path, flags, how & KMP_OPEN_PRIVATE ? 0600 : 0666);
}

int kmp_file_close(int file)
{
    return close(file);
}

ptrdiff_t kmp_file_get(int file, void *to, size_t size)
{
    ssize_t n;
    while ((n = read(file, to, size)) < 0 && errno == EINTR)
        ;
    return n;
}

int kmp_file_put(int file, const void *from, size_t size)
{
    const unsigned char *at = from;
    while (size > 0) {
        ssize_t n = write(file, at, size);
        if (n < 0 && errno == EINTR)
            continue;
        if (n < 0)
            return errno;
        at += n;
        size -= (size_t)n;
    }
    return 0;
}

int kmp_file_sync(int file)
{
#ifdef F_FULLFSYNC /* macOS leaves the file in the memory of the disk otherwise */
    if (fcntl(file, F_FULLFSYNC) == 0)
        return 0;
#endif
    return fsync(file) == 0 || errno == EINVAL ? 0 : errno;
}

int kmp_file_cut(int file, uint64_t size)
{
    return ftruncate(file, (off_t)size) == 0 ? 0 : errno;
}

int kmp_file_permit(int file, unsigned permissions)
{
    return fchmod(file, (mode_t)permissions) == 0 ? 0 : errno;
}

void kmp_path_touch(const char *path)
{
    (void)utimensat(AT_FDCWD, path, NULL, 0);
}

void kmp_file_touch(int file)
{
    (void)futimens(file, NULL);
}

FILE *kmp_file_stream_of(int file)
{
    return fdopen(file, "rb");
}

int kmp_file_temporary(char *path)
{
    return mkstemp(path);
}

bool kmp_folder_temporary(char *path)
{
    return mkdtemp(path);
}

int kmp_path_rename(const char *from, const char *to)
{
    return rename(from, to) == 0 ? 0 : errno;
}

int kmp_path_link(const char *from, const char *to)
{
    return link(from, to) == 0 ? 0 : errno;
}

bool kmp_path_remove(const char *path)
{
    return unlink(path) == 0;
}

bool kmp_folder_create(const char *path, bool is_private)
{
    return mkdir(path, is_private ? 0700 : 0777) == 0;
}

bool kmp_folder_remove(const char *path)
{
    return rmdir(path) == 0;
}

void kmp_folder_sync(const char *path)
{
    int fd = open(path, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (fd < 0)
        return;
    (void)fsync(fd);
    close(fd);
}

kmp_folder_names *kmp_folder_names_begin(const char *path)
{
    return (kmp_folder_names *)opendir(path);
}

const char *kmp_folder_names_next(kmp_folder_names *names)
{
    const struct dirent *entry = readdir((DIR *)names);
    return entry ? entry->d_name : NULL;
}

void kmp_folder_names_end(kmp_folder_names *names)
{
    if (names)
        closedir((DIR *)names);
}

uint64_t kmp_file_limit(void)
{
    struct rlimit limit;
    bool bounded = getrlimit(RLIMIT_FSIZE, &limit) == 0 && limit.rlim_cur != RLIM_INFINITY;
    return bounded ? (uint64_t)limit.rlim_cur : UINT64_MAX;
}

/* One at a time in each thread: a stream has no place for what it fills. */
static _Thread_local struct text_stream {
    char *text;
    size_t size;
} text_stream;

FILE *kmp_text_stream(void)
{
    text_stream = (struct text_stream){0};
    return open_memstream(&text_stream.text, &text_stream.size);
}

char *kmp_text_stream_end(FILE *stream)
{
    if (fclose(stream) == 0)
        return text_stream.text;
    free(text_stream.text);
    return NULL;
}

/* -- clocks ------------------------------------------------------------------------------------------ */

static double read_clock(clockid_t clock)
{
    struct timespec t;
    (void)clock_gettime(clock, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

#ifdef __EMSCRIPTEN__

/* One thread, whose processor time WebAssembly does not report. */
double kmp_cpu_now(void)
{
    return read_clock(CLOCK_MONOTONIC);
}

double kmp_thread_cpu(pthread_t thread)
{
    (void)thread;
    return 0;
}

#else

double kmp_cpu_now(void)
{
    return read_clock(CLOCK_THREAD_CPUTIME_ID);
}

double kmp_thread_cpu(pthread_t thread)
{
#ifdef __APPLE__
    (void)thread;
    return 0;
#else
    clockid_t clock;
    struct timespec t;
    if (pthread_getcpuclockid(thread, &clock) || clock_gettime(clock, &t))
        return 0;
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
#endif
}

#endif

double kmp_wall_now(void)
{
    return read_clock(CLOCK_MONOTONIC);
}

/* -- memory ------------------------------------------------------------------------------------------ */

#ifdef __EMSCRIPTEN__

/* WebAssembly runs only what is in its module. */
void *kmp_pages_new(const void *code, size_t size)
{
    (void)code, (void)size;
    return NULL;
}

void kmp_pages_free(void *pages, size_t size)
{
    (void)pages, (void)size;
}

#else

#if defined(__APPLE__) && defined(__aarch64__)
#define JIT MAP_JIT
static void protect_code(int protect)
{
    pthread_jit_write_protect_np(protect);
}
#else
#define JIT 0
static void protect_code(int protect)
{
    (void)protect;
}
#endif

void *kmp_pages_new(const void *code, size_t size)
{
    void *pages = size > 0 ? mmap(NULL, size, PROT_READ | PROT_WRITE | (JIT ? PROT_EXEC : 0),
                                  MAP_PRIVATE | MAP_ANONYMOUS | JIT, -1, 0)
                           : MAP_FAILED;
    if (pages == MAP_FAILED)
        return NULL;
    protect_code(0);
    memcpy(pages, code, size);
#ifdef __aarch64__ /* fetches instructions from another cache than data */
    __builtin___clear_cache(pages, (char *)pages + size);
#endif
    protect_code(1);
    if (JIT || mprotect(pages, size, PROT_READ | PROT_EXEC) == 0)
        return pages;
    (void)munmap(pages, size);
    return NULL;
}

void kmp_pages_free(void *pages, size_t size)
{
    if (pages)
        (void)munmap(pages, size);
}

#endif

size_t kmp_heap_in_use(void)
{
#if defined(__GLIBC__) && defined(__GLIBC_PREREQ)
#if __GLIBC_PREREQ(2, 33)
    struct mallinfo2 heap = mallinfo2();
    return heap.uordblks + heap.hblkhd;
#endif
#endif
    return 0;
}

/* -- threads ----------------------------------------------------------------------------------------- */

#ifdef __EMSCRIPTEN__

/* Memory is shared between threads only on pages that a server isolates: there are none. */
bool kmp_thread_start(pthread_t *thread, void *(*run)(void *user), void *user)
{
    (void)thread, (void)run, (void)user;
    return false;
}

bool kmp_thread_start_deaf(pthread_t *thread, void *(*run)(void *user), void *user)
{
    return kmp_thread_start(thread, run, user);
}

#else

bool kmp_thread_start(pthread_t *thread, void *(*run)(void *user), void *user)
{
    pthread_attr_t attributes;
    if (pthread_attr_init(&attributes) != 0)
        return false;
    (void)pthread_attr_setstacksize(&attributes, KMP_THREAD_STACK);
    bool started = pthread_create(thread, &attributes, run, user) == 0;
    (void)pthread_attr_destroy(&attributes);
    return started;
}

bool kmp_thread_start_deaf(pthread_t *thread, void *(*run)(void *user), void *user)
{
    sigset_t all, old;
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &old);
    bool started = kmp_thread_start(thread, run, user);
    pthread_sigmask(SIG_SETMASK, &old, NULL);
    return started;
}

#endif

void kmp_thread_yield(void)
{
    (void)sched_yield();
}

void kmp_thread_rest(long nanoseconds)
{
    (void)nanosleep(&(struct timespec){.tv_nsec = nanoseconds}, NULL);
}

int kmp_system_processors(void)
{
    long count = sysconf(_SC_NPROCESSORS_ONLN);
#ifdef __linux__
    cpu_set_t set;
    if (sched_getaffinity(0, sizeof set, &set) == 0)
        count = CPU_COUNT(&set);
#endif
    return count < 1 ? 1 : count > 1 << 20 ? 1 << 20 : (int)count;
}

/* -- processes --------------------------------------------------------------------------------------- */

long kmp_process_number(void)
{
    return (long)getpid();
}

#ifdef __APPLE__

/* In microseconds; 0 also of a zombie. */
unsigned long long kmp_process_start(long process)
{
    int path[] = {CTL_KERN, KERN_PROC, KERN_PROC_PID, (int)process};
    struct kinfo_proc about;
    size_t size = sizeof about;
    if (sysctl(path, 4, &about, &size, NULL, 0) != 0 || size < sizeof about || about.kp_proc.p_stat == SZOMB)
        return 0;
    const struct timeval start = about.kp_proc.p_starttime;
    return (unsigned long long)start.tv_sec * 1000000 + (unsigned long long)start.tv_usec;
}

/* The start of the system, by its identity. */
static void system_start(char *start, size_t size)
{
    if (sysctlbyname("kern.bootsessionuuid", start, &size, NULL, 0) != 0)
        start[0] = '\0';
}

#else

/* In clock ticks (proc_pid_stat(5), field 22); 0 also of a zombie. */
unsigned long long kmp_process_start(long process)
{
    char path[64], text[1024];
    (void)snprintf(path, sizeof path, "/proc/%ld/stat", process);
    FILE *file = fopen(path, "r");
    size_t length = file ? fread(text, 1, sizeof text - 1, file) : 0;
    if (file)
        fclose(file);
    text[length] = '\0';
    const char *s = strrchr(text, ')'); /* its name may have blanks */
    if (!s || s[1] != ' ' || s[2] == 'Z' || s[2] == 'X')
        return 0;
    for (int field = 2; s && field < 22; field++)
        s = strchr(s + 1, ' ');
    return s ? strtoull(s + 1, NULL, 10) : 0;
}

static void system_start(char *start, size_t size)
{
    FILE *file = fopen("/proc/sys/kernel/random/boot_id", "r");
    if (!file)
        return;
    start[strcspn(fgets(start, (int)size, file) ? start : "", "\n")] = '\0';
    fclose(file);
}

#endif

void kmp_system_word(char word[KMP_SYSTEM_WORD])
{
    char name[256] = "", boot[40] = "", space[64] = "";
    (void)gethostname(name, sizeof name - 1);
    system_start(boot, sizeof boot);
    ssize_t length = readlink("/proc/self/ns/pid", space, sizeof space - 1);
    space[length > 0 ? length : 0] = '\0';
    for (char *s = name; *s; s++)
        *s = (unsigned char)*s <= ' ' ? '_' : *s;
    (void)snprintf(word, KMP_SYSTEM_WORD, "%s/%s/%s", name, boot, space);
}

#ifdef __EMSCRIPTEN__

int kmp_process_run(char *const *words, const char *said)
{
    (void)words, (void)said;
    return -1;
}

kmp_process *kmp_process_begin(char *const *words, const char *folder, const char *said, const char *complained)
{
    (void)words, (void)folder, (void)said, (void)complained;
    return NULL;
}

bool kmp_process_has_ended(kmp_process *process, int *code)
{
    (void)process, (void)code;
    return false;
}

void kmp_process_interrupt(kmp_process *process)
{
    (void)process;
}

void kmp_process_end(kmp_process *process)
{
    (void)process;
}

int kmp_loopback_listen(int *port)
{
    (void)port;
    errno = ENOSYS;
    return -1;
}

bool kmp_connection_is_closed(int socket)
{
    (void)socket;
    return false;
}

#else

#ifdef __APPLE__ /* a shared library has no other way to it */
#define environ (*_NSGetEnviron())
#else
extern char **environ;
#endif

int kmp_process_run(char *const *words, const char *said)
{
    posix_spawn_file_actions_t actions;
    pid_t child = 0;
    int state = -1;
    if (posix_spawn_file_actions_init(&actions) != 0)
        return -1;
    bool ok = !said || (posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, said, O_WRONLY | O_CREAT | O_TRUNC,
                                                         0600) == 0 &&
                        posix_spawn_file_actions_adddup2(&actions, STDOUT_FILENO, STDERR_FILENO) == 0);
    ok = ok && posix_spawnp(&child, words[0], &actions, NULL, words, environ) == 0;
    posix_spawn_file_actions_destroy(&actions);
    if (!ok || waitpid(child, &state, 0) != child || !WIFEXITED(state))
        return -1;
    return WEXITSTATUS(state);
}

struct kmp_process {
    pid_t number;
    bool ended, asked;
    int code;
};

/* In the child, by functions that signals may interrupt: the program, with the signals of one that a user begins.
 * Ctrl-C of this one's terminal is not for it. */
static _Noreturn void become(char *const *words, const char *folder, const char *said, const char *complained)
{
    static const int usual[] = {SIGINT, SIGTERM, SIGPIPE};
    const char *const files[] = {"/dev/null", said, complained};
    const struct sigaction set = {.sa_handler = SIG_DFL};
    sigset_t none;
    sigemptyset(&none);
    bool ok = setpgid(0, 0) == 0;
    for (size_t k = 0; k < sizeof usual / sizeof *usual; k++)
        ok = ok && sigaction(usual[k], &set, NULL) == 0;
    for (int k = 0; ok && k < 3; k++) {
        const int file = open(files[k], k == STDIN_FILENO ? O_RDONLY : O_WRONLY | O_CREAT | O_TRUNC, 0600);
        ok = file >= 0 && dup2(file, k) == k && (file == k || close(file) == 0);
    }
    if (ok && chdir(folder) == 0 && sigprocmask(SIG_SETMASK, &none, NULL) == 0)
        (void)execv(words[0], words);
    _exit(127);
}

/* Without posix_spawn, which changes the folder only in glibc 2.29 and later. */
kmp_process *kmp_process_begin(char *const *words, const char *folder, const char *said, const char *complained)
{
    const bool there = access(words[0], X_OK) == 0 && access(folder, X_OK) == 0;
    kmp_process *process = there ? calloc(1, sizeof *process) : NULL;
    if (!process)
        return NULL;
    /* A signal to the child waits until it has its own handlers: the handlers of this process would lose it. */
    sigset_t stops, usual;
    sigemptyset(&stops);
    sigaddset(&stops, SIGINT);
    sigaddset(&stops, SIGTERM);
    (void)pthread_sigmask(SIG_BLOCK, &stops, &usual);
    process->number = fork();
    if (process->number == 0)
        become(words, folder, said, complained);
    (void)pthread_sigmask(SIG_SETMASK, &usual, NULL);
    if (process->number > 0)
        return process;
    free(process);
    return NULL;
}

bool kmp_process_has_ended(kmp_process *process, int *code)
{
    int state = 0;
    if (!process->ended && waitpid(process->number, &state, WNOHANG) == process->number) {
        process->ended = true;
        process->code = WIFEXITED(state) ? WEXITSTATUS(state) : -1;
    }
    *code = process->code;
    return process->ended;
}

void kmp_process_interrupt(kmp_process *process)
{
    if (!process->ended && !process->asked) /* a second one would end it without a result */
        (void)kill(process->number, SIGINT);
    process->asked = true;
}

void kmp_process_end(kmp_process *process)
{
    int state;
    if (process && !process->ended) {
        (void)kill(process->number, SIGKILL);
        (void)waitpid(process->number, &state, 0);
    }
    free(process);
}

int kmp_loopback_listen(int *port)
{
    struct sockaddr_in at = {.sin_family = AF_INET, .sin_port = htons((uint16_t)*port)};
    socklen_t size = sizeof at;
    const int again = 1, made = socket(AF_INET, SOCK_STREAM, 0);
    at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    if (made >= 0 && fcntl(made, F_SETFD, FD_CLOEXEC) == 0 &&
        setsockopt(made, SOL_SOCKET, SO_REUSEADDR, &again, sizeof again) == 0 &&
        bind(made, (const struct sockaddr *)&at, sizeof at) == 0 && listen(made, SOMAXCONN) == 0 &&
        getsockname(made, (struct sockaddr *)&at, &size) == 0) {
        *port = ntohs(at.sin_port);
        return made;
    }
    const int error = errno;
    if (made >= 0)
        (void)close(made);
    errno = error;
    return -1;
}

bool kmp_connection_is_closed(int socket)
{
    char byte;
    return recv(socket, &byte, 1, MSG_PEEK | MSG_DONTWAIT) == 0;
}

#endif

bool kmp_secret(void *bytes, size_t size)
{
    const int file = kmp_file_open("/dev/urandom", KMP_OPEN_READ);
    const ptrdiff_t count = file < 0 ? -1 : kmp_file_get(file, bytes, size);
    if (file >= 0)
        (void)kmp_file_close(file);
    return count == (ptrdiff_t)size;
}

const char *kmp_page_opener(void)
{
#ifdef __APPLE__
    return "open";
#else
    return "xdg-open";
#endif
}

bool kmp_page_open(const char *path)
{
    char *const words[] = {(char *)kmp_page_opener(), (char *)path, NULL};
    return kmp_process_run(words, NULL) == 0;
}

#ifdef __linux__

/* The linker gives each executable and library an identity, a digest of its content (NT_GNU_BUILD_ID). */

typedef struct search {
    kmp_identity_part *part;
    void *user;
    bool own; /* the object with this code has an identity */
} search;

/* True if a segment of the object has the address. */
static bool has(const struct dl_phdr_info *object, uintptr_t address)
{
    for (int k = 0; k < object->dlpi_phnum; k++) {
        const ElfW(Phdr) *p = &object->dlpi_phdr[k];
        uintptr_t first = (uintptr_t)object->dlpi_addr + p->p_vaddr;
        if (p->p_type == PT_LOAD && address >= first && address - first < p->p_memsz)
            return true;
    }
    return false;
}

/* Finds the identity among the notes of a segment; NULL: it is not there. */
static const unsigned char *identity_in(const unsigned char *at, size_t size, size_t *length)
{
    ElfW(Nhdr) note;
    while (size >= sizeof note) {
        memcpy(&note, at, sizeof note);
        size_t name = (note.n_namesz + 3u) / 4 * 4, content = (note.n_descsz + 3u) / 4 * 4;
        if (sizeof note + name + content > size)
            return NULL;
        if (note.n_type == NT_GNU_BUILD_ID && note.n_namesz == 4 && memcmp(at + sizeof note, "GNU", 4) == 0) {
            *length = note.n_descsz;
            return at + sizeof note + name;
        }
        at += sizeof note + name + content;
        size -= sizeof note + name + content;
    }
    return NULL;
}

static int add_object(struct dl_phdr_info *object, size_t info, void *user)
{
    search *s = user;
    (void)info;
    for (int k = 0; k < object->dlpi_phnum; k++) {
        const ElfW(Phdr) *p = &object->dlpi_phdr[k];
        size_t length;
        const unsigned char *notes = (const unsigned char *)(uintptr_t)(object->dlpi_addr + p->p_vaddr);
        const unsigned char *identity = p->p_type == PT_NOTE ? identity_in(notes, p->p_memsz, &length) : NULL;
        if (!identity)
            continue;
        s->part(s->user, NULL, identity, length);
        s->own = s->own || has(object, (uintptr_t)&add_object);
        return 0;
    }
    s->part(s->user, object->dlpi_name, NULL, 0);
    return 0;
}

bool kmp_build_identity(kmp_identity_part *part, void *user)
{
    search s = {part, user, false};
    (void)dl_iterate_phdr(add_object, &s);
    return s.own;
}

#else
bool kmp_build_identity(kmp_identity_part *part, void *user)
{
    (void)part;
    (void)user;
    return false;
}
#endif

/* -- signals ----------------------------------------------------------------------------------------- */

void kmp_interrupts_to(void (*handler)(int number))
{
    struct sigaction action = {.sa_flags = (int)SA_RESETHAND};
    action.sa_handler = handler;
    sigemptyset(&action.sa_mask);
    sigaction(SIGINT, &action, NULL);
    sigaction(SIGTERM, &action, NULL);
    signal(SIGXFSZ, SIG_IGN);
}

static void (*volatile guard)(void);
static struct sigaction before;

static void on_guarded(int number, siginfo_t *info, void *state)
{
    if (before.sa_flags & SA_SIGINFO)
        before.sa_sigaction(number, info, state);
    else if (before.sa_handler != SIG_DFL && before.sa_handler != SIG_IGN)
        before.sa_handler(number);
    guard();
}

void kmp_interrupt_guard(void (*handler)(void))
{
    struct sigaction action;
    memset(&action, 0, sizeof action);
    action.sa_sigaction = on_guarded;
    action.sa_flags = SA_SIGINFO;
    sigemptyset(&action.sa_mask);
    guard = handler;
    sigaction(SIGINT, NULL, &before);
    sigaction(SIGINT, &action, NULL);
}

void kmp_interrupt_guard_end(void)
{
    sigaction(SIGINT, &before, NULL);
}

/* -- libraries --------------------------------------------------------------------------------------- */

#ifdef __EMSCRIPTEN__

void *kmp_library_open(const char *name)
{
    (void)name;
    return NULL;
}

void *kmp_library_find(void *library, const char *symbol)
{
    (void)library, (void)symbol;
    return NULL;
}

void kmp_library_close(void *library)
{
    (void)library;
}

const char *kmp_library_reason(void)
{
    return "WebAssembly has no shared libraries";
}

#else

void *kmp_library_open(const char *name)
{
    void *found = dlopen(name, name ? RTLD_NOW | RTLD_LOCAL : RTLD_LAZY);
#ifdef __APPLE__ /* it does not look where Homebrew and MacPorts install */
    static const char *const folders[] = {"/opt/homebrew/lib", "/opt/local/lib"};
    for (size_t k = 0; !found && name && !strchr(name, '/') && k < sizeof folders / sizeof *folders; k++) {
        char path[KMP_PATH_MOST];
        const int length = snprintf(path, sizeof path, "%s/%s", folders[k], name);
        found = length < (int)sizeof path ? dlopen(path, RTLD_NOW | RTLD_LOCAL) : NULL;
    }
#endif
    return found;
}

void *kmp_library_find(void *library, const char *symbol)
{
    return dlsym(library, symbol);
}

void kmp_library_close(void *library)
{
    (void)dlclose(library);
}

const char *kmp_library_reason(void)
{
    const char *why = dlerror();
    return why ? why : "unknown error of the loader";
}

#endif

#ifdef __APPLE__
const char kmp_library_ending[] = ".dylib";
#else
const char kmp_library_ending[] = ".so";
#endif

const char *kmp_platform_of_units(int fmi)
{
#if defined(__linux__) && defined(__x86_64__)
    return fmi == 2 ? "linux64" : "x86_64-linux";
#elif defined(__linux__) && defined(__aarch64__)
    return fmi == 2 ? "aarch64-linux" : "aarch64-linux";
#elif defined(__APPLE__) && defined(__x86_64__)
    return fmi == 2 ? "darwin64" : "x86_64-darwin";
#elif defined(__APPLE__)
    return fmi == 2 ? "darwin64" : "aarch64-darwin";
#else
    (void)fmi;
    return "";
#endif
}

/* -- the command ------------------------------------------------------------------------------------- */

void kmp_command_begin(int *count, char ***words)
{
    (void)count;
    (void)words;
}

#ifdef __GLIBC__

/* Makes room in the heap, most of it in large pages: each takes one fault instead of 512. Small models need less than
 * SMALL, and would not fill a large page. */
static void take_large_pages(void)
{
#ifdef MADV_HUGEPAGE
    enum { ROOM = 32 << 20, SMALL = 1 << 20, PAGE = 2 << 20 };
    (void)mallopt(M_TOP_PAD, ROOM);
    char *first = malloc(SMALL); /* more than is left of the heap, which grows */
    if (!first)
        return;
    const uintptr_t end = (uintptr_t)sbrk(0), used = (uintptr_t)first + SMALL, skipped = PAGE - used % PAGE;
    if (used < end && end - used > skipped && end - used <= (uintptr_t)ROOM + PAGE)
        (void)madvise(first + SMALL + skipped, (end - used - skipped) / PAGE * PAGE, MADV_HUGEPAGE);
    free(first);
#endif
}

/* The C library would return freed memory to the system, which clears each page again. Arrays above OWN_PAGES bytes are
 * separate pages, and grow without a copy. */
void kmp_command_keep_memory(void)
{
    enum { MOST_KEPT = 256 << 20, OWN_PAGES = 16 << 20 };
    (void)mallopt(M_TRIM_THRESHOLD, MOST_KEPT);
    (void)mallopt(M_MMAP_THRESHOLD, OWN_PAGES);
    take_large_pages();
}

#else
void kmp_command_keep_memory(void)
{
}
#endif

bool kmp_is_terminal(FILE *stream)
{
    return isatty(fileno(stream)) != 0;
}

int kmp_terminal_width(void)
{
    struct winsize size = {0};
    return ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 ? size.ws_col : 0;
}
