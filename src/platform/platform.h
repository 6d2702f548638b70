/* SPDX-License-Identifier: BSD-3-Clause */
/* All that systems do differently: paths, files, folders, clocks, memory for machine code, threads, processes, signals,
 * libraries, terminals. One side is in platform_posix.c, one in platform_windows.c. No other file depends on the
 * system.
 *
 * Paths and words are UTF-8 and end with zero; files are bytes, so lines end as they are written. After an error,
 * functions that return a file return -1, functions that return bool return false, and errno has the reason. */
#pragma once

#include <pthread.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h> /* defines __GLIBC__ */
#include <stdio.h>

/* The loader chooses among clones of a function (base/clones.h). */
#ifdef __GLIBC__
#define KMP_LOADER_CHOOSES 1
#else
#define KMP_LOADER_CHOOSES 0
#endif

/* -- paths ------------------------------------------------------------------------------------------- */

enum { KMP_PATH_MOST = 4096 }; /* characters of a path, with the final zero */

bool kmp_is_separator(char c);

/** The length of the part of a path before its last name, with its separator; 0: the path is only a name. */
size_t kmp_path_folder(const char *path);

/** The last name of a path, "" behind a separator. */
const char *kmp_path_name(const char *path);

/** True if the path does not depend on the working folder. */
bool kmp_path_is_whole(const char *path);

/** The whole path of a file that is there, without links, with the separator /. */
bool kmp_path_real(const char *path, char real[KMP_PATH_MOST]);

/** The path of the running command, likewise. */
bool kmp_path_of_command(char path[KMP_PATH_MOST]);

/** The folder for temporary files; the folder in which Kempe keeps the user's results, "": there is none. */
void kmp_path_temporary(char path[KMP_PATH_MOST]);
void kmp_path_cache(char path[KMP_PATH_MOST]);

/** A variable of the environment, NULL: it is not set. Valid until the next call of this thread. */
const char *kmp_environment(const char *name);

/* -- files ------------------------------------------------------------------------------------------- */

typedef enum kmp_path_kind { KMP_PATH_FILE, KMP_PATH_FOLDER, KMP_PATH_PIPE, KMP_PATH_OTHER } kmp_path_kind;

typedef struct kmp_path_state {
    kmp_path_kind kind;
    uint64_t size;           /* bytes */
    uint64_t device, number; /* equal for two paths of one file */
    int64_t changed;         /* s */
    long changed_ns;
    unsigned permissions;
    bool own; /* a file of this user that no other one can have written */
} kmp_path_state;

/** The state of a path, through a symbolic link or of the link itself (of kind OTHER); of an open file. */
bool kmp_path_look(const char *path, kmp_path_state *state);
bool kmp_path_look_here(const char *path, kmp_path_state *state);
bool kmp_file_look(int file, kmp_path_state *state);

bool kmp_path_exists(const char *path);
bool kmp_path_readable(const char *path);

typedef enum kmp_open {
    KMP_OPEN_READ = 1,
    KMP_OPEN_WRITE = 2,
    KMP_OPEN_APPEND = 4,   /* also writes */
    KMP_OPEN_CREATE = 8,   /* where it is missing */
    KMP_OPEN_NEW = 16,     /* creates; EEXIST where it is there */
    KMP_OPEN_AT_ONCE = 32, /* does not wait for the other end of a pipe */
    KMP_OPEN_NO_LINK = 64, /* not through a symbolic link */
    KMP_OPEN_PRIVATE = 128 /* no other user may open a created file */
} kmp_open;

/** Opens a file, which processes that are started do not inherit. `how`: kmp_open. */
int kmp_file_open(const char *path, unsigned how);
int kmp_file_close(int file);

/** Reads up to `size` bytes; their number, 0 at the end. Writes all bytes; 0 or an errno. */
ptrdiff_t kmp_file_get(int file, void *to, size_t size);
int kmp_file_put(int file, const void *from, size_t size);

/** The file is on its disk. */
int kmp_file_sync(int file);
int kmp_file_cut(int file, uint64_t size);
int kmp_file_permit(int file, unsigned permissions);

/** Sets the time of the last change to now: of a path, of an open file. */
void kmp_path_touch(const char *path);
void kmp_file_touch(int file);

/** A stream of an open file, which it closes. */
FILE *kmp_file_stream_of(int file);

/** A new file, or a new folder, for this user only; the X at the end of the path are replaced. */
int kmp_file_temporary(char *path);
bool kmp_folder_temporary(char *path);

/** Gives a file another name, whatever has this name; a second name, EEXIST if something has it. 0 or an errno. */
int kmp_path_rename(const char *from, const char *to);
int kmp_path_link(const char *from, const char *to);
bool kmp_path_remove(const char *path);

/** Makes a folder, removes an empty one. */
bool kmp_folder_create(const char *path, bool is_private);
bool kmp_folder_remove(const char *path);

/** Makes the names in a folder last through a loss of power, where the system can. */
void kmp_folder_sync(const char *path);

/** The names in a folder, one at a time in any order; NULL: it cannot be read, there are no more. */
typedef struct kmp_folder_names kmp_folder_names;
kmp_folder_names *kmp_folder_names_begin(const char *path);
const char *kmp_folder_names_next(kmp_folder_names *names);
void kmp_folder_names_end(kmp_folder_names *names);

/** Bytes that a file of this process may have. */
uint64_t kmp_file_limit(void);

/** A stream whose text is kept in memory; its end gives the text (free with free()), NULL: no memory. */
FILE *kmp_text_stream(void);
char *kmp_text_stream_end(FILE *stream);

/* -- clocks ------------------------------------------------------------------------------------------ */

/** Seconds of processor time of this thread, from some beginning; of another thread, 0 where it is not known. */
double kmp_cpu_now(void);
double kmp_thread_cpu(pthread_t thread);

/** Seconds on the wall, from some beginning; they never go back. */
double kmp_wall_now(void);

/* -- memory ------------------------------------------------------------------------------------------ */

/** A copy of machine code that can be run, in pages that are written first and executable after, never both (but for
 * macOS on arm64); NULL: the system does not allow it. */
void *kmp_pages_new(const void *code, size_t size);
void kmp_pages_free(void *pages, size_t size);

/** Bytes of the heap in use, including other libraries; 0: the C library does not report. */
size_t kmp_heap_in_use(void);

/* -- threads ----------------------------------------------------------------------------------------- */

/** Starts a thread with a stack of KMP_THREAD_STACK bytes, whatever the default of the system is (128 KiB in some).
 * A deaf one takes no signals. */
enum { KMP_THREAD_STACK = 2 << 20 };
bool kmp_thread_start(pthread_t *thread, void *(*run)(void *user), void *user);
bool kmp_thread_start_deaf(pthread_t *thread, void *(*run)(void *user), void *user);

/** Gives the processor to another thread; rests for some nanoseconds. */
void kmp_thread_yield(void);
void kmp_thread_rest(long nanoseconds);

/** Processors that this process may use. */
int kmp_system_processors(void);

/* -- processes --------------------------------------------------------------------------------------- */

/** The number of this process. When a process began, in some unit; 0: it does not run. */
long kmp_process_number(void);
unsigned long long kmp_process_start(long process);

/** A word that processes share whose numbers have one meaning: host, start of its system, space of numbers. */
enum { KMP_SYSTEM_WORD = 400 };
void kmp_system_word(char word[KMP_SYSTEM_WORD]);

/** Runs a program with words that NULL ends; its output goes to the file `said`, NULL: to this process's. The exit
 * status, -1: it did not run. */
int kmp_process_run(char *const *words, const char *said);

/** A program, its words ended by NULL, that runs while this one continues, in a folder, with its output and its
 * complaints in two files; NULL: it does not run. An interrupt asks it to end, as a user does. The end frees it, and
 * ends it where it still runs. */
typedef struct kmp_process kmp_process;
kmp_process *kmp_process_begin(char *const *words, const char *folder, const char *said, const char *complained);
void kmp_process_interrupt(kmp_process *process);
void kmp_process_end(kmp_process *process);

/** True if it has ended: *code is its exit status, -1 where it was ended by force. */
bool kmp_process_has_ended(kmp_process *process, int *code);

/** A socket that takes connections of this machine only, at 127.0.0.1 and the port, 0: any, which is then written. -1
 * and errno: there is none. */
int kmp_loopback_listen(int *port);

/** True if the other side of a connection has closed it. */
bool kmp_connection_is_closed(int socket);

/** Bytes that cannot be foreseen. */
bool kmp_secret(void *bytes, size_t size);

/** Opens a page with the program that the desktop has for it; a name for sentences. */
bool kmp_page_open(const char *path);
const char *kmp_page_opener(void);

/** Takes one part of the identity of this process: bytes, or a name. */
typedef void kmp_identity_part(void *user, const char *name, const void *bytes, size_t size);

/** Tells the identities of this program's build and of the libraries it has loaded; false: the build has none. */
bool kmp_build_identity(kmp_identity_part *part, void *user);

/* -- signals ----------------------------------------------------------------------------------------- */

/** The first interrupt of the user calls the handler, the second one ends the process. Writing a file beyond a limit is
 * an error, and no signal. */
void kmp_interrupts_to(void (*handler)(int number));

/** Until the end, an interrupt calls the handler that was there, then this one, perhaps in another thread. Guards are
 * not nested. */
void kmp_interrupt_guard(void (*handler)(void));
void kmp_interrupt_guard_end(void);

/* -- libraries --------------------------------------------------------------------------------------- */

/** A shared library by its name (NULL: the process with all it has loaded), and the address of a symbol; NULL: it is
 * not there. The reason of the last failure. Functions by a list of names: base/loaded_library.h. */
void *kmp_library_open(const char *name);
void *kmp_library_find(void *library, const char *symbol);
void kmp_library_close(void *library);
const char *kmp_library_reason(void);

/** The file of a version of a shared library, as programs ask for it that were linked with it. Words are literals. */
#if defined(_WIN32)
#define KMP_LIBRARY_FILE(name, version) "lib" name "-" version ".dll"
#elif defined(__APPLE__)
#define KMP_LIBRARY_FILE(name, version) "lib" name "." version ".dylib"
#else
#define KMP_LIBRARY_FILE(name, version) "lib" name ".so." version
#endif

/** The ending of shared libraries, ".so"; the word of the FMI standard for this platform, "": it has none. */
extern const char kmp_library_ending[];
const char *kmp_platform_of_units(int fmi);

/* -- the command ------------------------------------------------------------------------------------- */

/** Its words in UTF-8, its streams as bytes. */
void kmp_command_begin(int *count, char ***words);

/** Sets the heap up for equations, which take and free much memory several times. */
void kmp_command_keep_memory(void);

bool kmp_is_terminal(FILE *stream);

/** Columns of the terminal of standard error, 0: unknown. */
int kmp_terminal_width(void);
