/* SPDX-License-Identifier: BSD-3-Clause */
/* The platform by Windows: paths and words are UTF-8 here and UTF-16 there. Files are numbers of the C library, always
 * of bytes. Threads come from winpthreads. */
#define _CRT_RAND_S /* rand_s of stdlib.h */
#include "platform/platform.h"
#include <direct.h>
#include <errno.h>
#include <fcntl.h>
#include <io.h>
#include <math.h>
#include <process.h>
#include <sched.h>
#include <share.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#define WIN32_LEAN_AND_MEAN
#include <windows.h>
/* after windows.h */
#include <shellapi.h>

/* -- words ------------------------------------------------------------------------------------------- */

typedef wchar_t wide_path[KMP_PATH_MOST];

/* The UTF-16 of a path; false: it is too long, or no UTF-8. */
static bool widen(const char *path, wide_path wide)
{
    const bool fits = MultiByteToWideChar(CP_UTF8, MB_ERR_INVALID_CHARS, path, -1, wide, KMP_PATH_MOST) > 0;
    if (!fits)
        errno = GetLastError() == ERROR_INSUFFICIENT_BUFFER ? ENAMETOOLONG : EILSEQ;
    return fits;
}

static bool narrow(const wchar_t *wide, char *to, int size)
{
    const bool fits = WideCharToMultiByte(CP_UTF8, 0, wide, -1, to, size, NULL, NULL) > 0;
    if (!fits)
        errno = ENAMETOOLONG;
    return fits;
}

/* The UTF-16 of a text (free with free()), NULL: no memory. */
static wchar_t *widened(const char *text)
{
    const int size = MultiByteToWideChar(CP_UTF8, 0, text, -1, NULL, 0);
    wchar_t *wide = calloc((size_t)size + 1, sizeof *wide);
    if (wide)
        (void)MultiByteToWideChar(CP_UTF8, 0, text, -1, wide, size + 1);
    return wide;
}

/* The errno of the last failure of the system. */
static int error_now(void)
{
    switch (GetLastError()) {
    case ERROR_FILE_NOT_FOUND:
    case ERROR_PATH_NOT_FOUND:
    case ERROR_INVALID_NAME:
    case ERROR_BAD_NETPATH:
        return ENOENT;
    case ERROR_ALREADY_EXISTS:
    case ERROR_FILE_EXISTS:
        return EEXIST;
    case ERROR_NOT_ENOUGH_MEMORY:
        return ENOMEM;
    case ERROR_DISK_FULL:
        return ENOSPC;
    case ERROR_DIR_NOT_EMPTY:
        return ENOTEMPTY;
    case ERROR_INVALID_FUNCTION:
    case ERROR_NOT_SUPPORTED:
        return ENOSYS;
    default:
        return EACCES;
    }
}

static bool succeeds(BOOL done)
{
    if (!done)
        errno = error_now();
    return done != 0;
}

/* -- paths ------------------------------------------------------------------------------------------- */

bool kmp_is_separator(char c)
{
    return c == '/' || c == '\\';
}

static bool has_drive(const char *path)
{
    return ((path[0] >= 'a' && path[0] <= 'z') || (path[0] >= 'A' && path[0] <= 'Z')) && path[1] == ':';
}

size_t kmp_path_folder(const char *path)
{
    size_t length = has_drive(path) ? 2 : 0;
    for (size_t k = length; path[k]; k++)
        length = kmp_is_separator(path[k]) ? k + 1 : length;
    return length;
}

const char *kmp_path_name(const char *path)
{
    return path + kmp_path_folder(path);
}

bool kmp_path_is_whole(const char *path)
{
    return kmp_is_separator(path[0]) || has_drive(path);
}

/* Paths that the system gives: without its prefix of long ones, with /. */
static bool narrow_path(const wchar_t *wide, char path[KMP_PATH_MOST])
{
    const bool unc = wcsncmp(wide, L"\\\\?\\UNC\\", 8) == 0, is_long = !unc && wcsncmp(wide, L"\\\\?\\", 4) == 0;
    if (!narrow(wide + (unc ? 6 : is_long ? 4 : 0), path, KMP_PATH_MOST))
        return false;
    for (char *c = path; *c; c++)
        *c = kmp_is_separator(*c) ? '/' : *c;
    if (unc)
        path[0] = '/';
    return true;
}

bool kmp_path_real(const char *path, char real[KMP_PATH_MOST])
{
    wide_path wide, whole;
    if (!widen(path, wide))
        return false;
    HANDLE file = CreateFileW(wide, 0, FILE_SHARE_READ | FILE_SHARE_WRITE | FILE_SHARE_DELETE, NULL, OPEN_EXISTING,
                              FILE_FLAG_BACKUP_SEMANTICS, NULL);
    if (file == INVALID_HANDLE_VALUE)
        return succeeds(0);
    const DWORD length = GetFinalPathNameByHandleW(file, whole, KMP_PATH_MOST, 0);
    CloseHandle(file);
    return succeeds(length > 0 && length < KMP_PATH_MOST) && narrow_path(whole, real);
}

bool kmp_path_of_command(char path[KMP_PATH_MOST])
{
    wide_path wide;
    const DWORD length = GetModuleFileNameW(NULL, wide, KMP_PATH_MOST);
    return length > 0 && length < KMP_PATH_MOST && narrow_path(wide, path);
}

void kmp_path_temporary(char path[KMP_PATH_MOST])
{
    wide_path wide;
    const DWORD length = GetTempPathW(KMP_PATH_MOST, wide);
    if (length == 0 || length >= KMP_PATH_MOST || !narrow_path(wide, path))
        memcpy(path, ".", 2);
    size_t end = strlen(path);
    if (end > 1 && path[end - 1] == '/')
        path[end - 1] = '\0';
}

void kmp_path_cache(char path[KMP_PATH_MOST])
{
    const char *home = kmp_environment("LOCALAPPDATA");
    const int length = home && *home ? snprintf(path, KMP_PATH_MOST, "%s/kempe", home) : 0;
    if (length <= 0 || length >= KMP_PATH_MOST)
        path[0] = '\0';
}

const char *kmp_environment(const char *name)
{
    static _Thread_local char value[KMP_PATH_MOST];
    wide_path wide;
    const wchar_t *found = widen(name, wide) ? _wgetenv(wide) : NULL;
    return found && narrow(found, value, sizeof value) ? value : NULL;
}

/* -- files ------------------------------------------------------------------------------------------- */

static HANDLE handle_of(int file)
{
    return (HANDLE)_get_osfhandle(file);
}

static bool look(HANDLE file, kmp_path_state *state)
{
    BY_HANDLE_FILE_INFORMATION about = {0};
    const DWORD type = GetFileType(file);
    if (type == FILE_TYPE_DISK && !succeeds(GetFileInformationByHandle(file, &about)))
        return false;
    enum { TICKS = 10000000 };                  /* in a second, since 1601 */
    static const int64_t TO_1970 = 11644473600; /* s */
    const uint64_t time =
        (uint64_t)about.ftLastWriteTime.dwHighDateTime << 32 | (uint64_t)about.ftLastWriteTime.dwLowDateTime;
    *state = (kmp_path_state){
        .kind = type == FILE_TYPE_PIPE                              ? KMP_PATH_PIPE
                : type != FILE_TYPE_DISK                            ? KMP_PATH_OTHER
                : about.dwFileAttributes & FILE_ATTRIBUTE_DIRECTORY ? KMP_PATH_FOLDER
                                                                    : KMP_PATH_FILE,
        .size = (uint64_t)about.nFileSizeHigh << 32 | about.nFileSizeLow,
        .device = about.dwVolumeSerialNumber,
        .number = (uint64_t)about.nFileIndexHigh << 32 | about.nFileIndexLow,
        .changed = (int64_t)(time / TICKS) - TO_1970,
        .changed_ns = (long)(time % TICKS) * 100,
        .permissions = 0666,
        .own = type == FILE_TYPE_DISK, /* the user's folders are closed to others by their lists of access */
    };
    return true;
}

static bool look_at(const char *path, DWORD flags, kmp_path_state *state)
{
    wide_path wide;
    if (!widen(path, wide))
        return false;
    HANDLE file = CreateFileW(wide, FILE_READ_ATTRIBUTES, FILE_SHARE_READ | FILE_SHARE_WRITE | FILE_SHARE_DELETE, NULL,
                              OPEN_EXISTING, FILE_FLAG_BACKUP_SEMANTICS | flags, NULL);
    if (file == INVALID_HANDLE_VALUE)
        return succeeds(0);
    const bool seen = look(file, state);
    CloseHandle(file);
    return seen;
}

bool kmp_path_look(const char *path, kmp_path_state *state)
{
    return look_at(path, 0, state);
}

static DWORD attributes_of(const char *path)
{
    wide_path wide;
    const DWORD attributes = widen(path, wide) ? GetFileAttributesW(wide) : INVALID_FILE_ATTRIBUTES;
    if (attributes == INVALID_FILE_ATTRIBUTES)
        errno = error_now();
    return attributes;
}

bool kmp_path_look_here(const char *path, kmp_path_state *state)
{
    const DWORD attributes = attributes_of(path);
    if (attributes == INVALID_FILE_ATTRIBUTES || !look_at(path, FILE_FLAG_OPEN_REPARSE_POINT, state))
        return false;
    state->kind = attributes & FILE_ATTRIBUTE_REPARSE_POINT ? KMP_PATH_OTHER : state->kind;
    return true;
}

bool kmp_file_look(int file, kmp_path_state *state)
{
    return look(handle_of(file), state);
}

bool kmp_path_exists(const char *path)
{
    return attributes_of(path) != INVALID_FILE_ATTRIBUTES;
}

bool kmp_path_readable(const char *path)
{
    wide_path wide;
    return widen(path, wide) && _waccess(wide, 4) == 0;
}

/* Other processes may rename and remove an open file, as they may elsewhere. */
int kmp_file_open(const char *path, unsigned how)
{
    wide_path wide;
    if (!widen(path, wide))
        return -1;
    const DWORD attributes = GetFileAttributesW(wide);
    const bool there = attributes != INVALID_FILE_ATTRIBUTES;
    if (there && (attributes & FILE_ATTRIBUTE_DIRECTORY)) {
        errno = how & KMP_OPEN_NEW ? EEXIST : EISDIR;
        return -1;
    }
    if (there && (how & KMP_OPEN_NO_LINK) && (attributes & FILE_ATTRIBUTE_REPARSE_POINT)) {
        errno = EACCES;
        return -1;
    }
    const bool appends = how & KMP_OPEN_APPEND, writes = appends || (how & KMP_OPEN_WRITE);
    HANDLE file = CreateFileW(wide,
                              appends  ? FILE_APPEND_DATA | FILE_READ_ATTRIBUTES | SYNCHRONIZE
                              : writes ? GENERIC_WRITE | FILE_READ_ATTRIBUTES
                                       : GENERIC_READ | FILE_WRITE_ATTRIBUTES,
                              FILE_SHARE_READ | FILE_SHARE_WRITE | FILE_SHARE_DELETE, NULL,
                              how & KMP_OPEN_NEW      ? CREATE_NEW
                              : how & KMP_OPEN_CREATE ? OPEN_ALWAYS
                                                      : OPEN_EXISTING,
                              FILE_ATTRIBUTE_NORMAL, NULL);
    if (file == INVALID_HANDLE_VALUE && !writes) /* its times are not ours to set */
        file = CreateFileW(wide, GENERIC_READ, FILE_SHARE_READ | FILE_SHARE_WRITE | FILE_SHARE_DELETE, NULL,
                           OPEN_EXISTING, FILE_ATTRIBUTE_NORMAL, NULL);
    if (file == INVALID_HANDLE_VALUE) {
        errno = error_now();
        return -1;
    }
    const int opened = _open_osfhandle((intptr_t)file, _O_BINARY | _O_NOINHERIT | (appends ? _O_APPEND : 0) |
                                                           (writes ? _O_WRONLY : _O_RDONLY));
    if (opened < 0)
        CloseHandle(file);
    return opened;
}

int kmp_file_close(int file)
{
    return _close(file);
}

enum { MOST_AT_ONCE = 1 << 30 };

ptrdiff_t kmp_file_get(int file, void *to, size_t size)
{
    return _read(file, to, size < MOST_AT_ONCE ? (unsigned)size : MOST_AT_ONCE);
}

int kmp_file_put(int file, const void *from, size_t size)
{
    const unsigned char *at = from;
    while (size > 0) {
        const int n = _write(file, at, size < MOST_AT_ONCE ? (unsigned)size : MOST_AT_ONCE);
        if (n < 0)
            return errno;
        at += n;
        size -= (size_t)n;
    }
    return 0;
}

int kmp_file_sync(int file)
{
    return _commit(file) == 0 ? 0 : errno;
}

int kmp_file_cut(int file, uint64_t size)
{
    return _chsize_s(file, (int64_t)size);
}

int kmp_file_permit(int file, unsigned permissions)
{
    (void)file;
    (void)permissions;
    return 0;
}

static void touch(HANDLE file)
{
    FILETIME now;
    GetSystemTimeAsFileTime(&now);
    (void)SetFileTime(file, NULL, NULL, &now);
}

void kmp_path_touch(const char *path)
{
    wide_path wide;
    HANDLE file = widen(path, wide)
                      ? CreateFileW(wide, FILE_WRITE_ATTRIBUTES, FILE_SHARE_READ | FILE_SHARE_WRITE | FILE_SHARE_DELETE,
                                    NULL, OPEN_EXISTING, FILE_ATTRIBUTE_NORMAL, NULL)
                      : INVALID_HANDLE_VALUE;
    if (file == INVALID_HANDLE_VALUE)
        return;
    touch(file);
    CloseHandle(file);
}

void kmp_file_touch(int file)
{
    touch(handle_of(file));
}

FILE *kmp_file_stream_of(int file)
{
    return _fdopen(file, "rb");
}

/* Replaces the six X at the end by letters that no other call has; false: there is no such name. */
static bool next_name(char *path, unsigned *counter)
{
    static const char letters[] = "abcdefghijklmnopqrstuvwxyz0123456789";
    size_t length = strlen(path);
    uint64_t number = (uint64_t)GetTickCount64() * 7919 + (uint64_t)GetCurrentProcessId() * 104729 +
                      (uint64_t)GetCurrentThreadId() * 1299709 + *counter * 15485863u;
    for (size_t k = length < 6 ? 0 : length - 6; k < length; k++, number /= sizeof letters - 1)
        path[k] = letters[number % (sizeof letters - 1)];
    return ++*counter < 1000;
}

int kmp_file_temporary(char *path)
{
    unsigned counter = 0;
    while (next_name(path, &counter)) {
        const int file = kmp_file_open(path, KMP_OPEN_WRITE | KMP_OPEN_NEW | KMP_OPEN_PRIVATE);
        if (file >= 0 || errno != EEXIST)
            return file;
    }
    return -1;
}

bool kmp_folder_temporary(char *path)
{
    unsigned counter = 0;
    while (next_name(path, &counter)) {
        if (kmp_folder_create(path, true))
            return true;
        if (errno != EEXIST)
            return false;
    }
    return false;
}

int kmp_path_rename(const char *from, const char *to)
{
    wide_path old, new;
    if (!widen(from, old) || !widen(to, new))
        return errno;
    return MoveFileExW(old, new, MOVEFILE_REPLACE_EXISTING) ? 0 : error_now();
}

int kmp_path_link(const char *from, const char *to)
{
    wide_path old, new;
    if (!widen(from, old) || !widen(to, new))
        return errno;
    return CreateHardLinkW(new, old, NULL) ? 0 : error_now();
}

bool kmp_path_remove(const char *path)
{
    wide_path wide;
    return widen(path, wide) && succeeds(DeleteFileW(wide));
}

bool kmp_folder_create(const char *path, bool is_private)
{
    wide_path wide;
    (void)is_private; /* folders have the access of the folder above, the user's own in the user's */
    return widen(path, wide) && succeeds(CreateDirectoryW(wide, NULL));
}

bool kmp_folder_remove(const char *path)
{
    wide_path wide;
    return widen(path, wide) && succeeds(RemoveDirectoryW(wide));
}

void kmp_folder_sync(const char *path)
{
    (void)path;
}

struct kmp_folder_names {
    HANDLE search;
    WIN32_FIND_DATAW found;
    bool at_first;
    char name[3 * MAX_PATH + 1];
};

kmp_folder_names *kmp_folder_names_begin(const char *path)
{
    char pattern[KMP_PATH_MOST];
    wide_path wide;
    kmp_folder_names *names = calloc(1, sizeof *names);
    const int length = snprintf(pattern, sizeof pattern, "%s/*", path);
    if (!names || length >= KMP_PATH_MOST || !widen(pattern, wide)) {
        free(names);
        return NULL;
    }
    names->search = FindFirstFileW(wide, &names->found);
    names->at_first = true;
    if (names->search != INVALID_HANDLE_VALUE)
        return names;
    errno = error_now();
    free(names);
    return NULL;
}

const char *kmp_folder_names_next(kmp_folder_names *names)
{
    do {
        if (!names->at_first && !FindNextFileW(names->search, &names->found))
            return NULL;
        names->at_first = false;
    } while (!narrow(names->found.cFileName, names->name, sizeof names->name));
    return names->name;
}

void kmp_folder_names_end(kmp_folder_names *names)
{
    if (!names)
        return;
    FindClose(names->search);
    free(names);
}

uint64_t kmp_file_limit(void)
{
    return UINT64_MAX;
}

/* A temporary file, which the system removes with its last handle. */
FILE *kmp_text_stream(void)
{
    char path[KMP_PATH_MOST];
    wide_path wide;
    kmp_path_temporary(path);
    const size_t length = strlen(path);
    (void)snprintf(path + length, sizeof path - length, "/kempe-XXXXXX");
    const int file = kmp_file_temporary(path);
    if (file < 0)
        return NULL;
    (void)kmp_file_close(file);
    return widen(path, wide) ? _wfopen(wide, L"w+bD") : NULL;
}

char *kmp_text_stream_end(FILE *stream)
{
    const long size = fflush(stream) == 0 ? ftell(stream) : -1;
    char *text = size >= 0 ? calloc((size_t)size + 1, 1) : NULL;
    rewind(stream);
    if (text && fread(text, 1, (size_t)size, stream) != (size_t)size) {
        free(text);
        text = NULL;
    }
    fclose(stream);
    return text;
}

/* -- clocks ------------------------------------------------------------------------------------------ */

static double seconds_of(HANDLE thread)
{
    FILETIME made, ended, kernel, user;
    if (!GetThreadTimes(thread, &made, &ended, &kernel, &user))
        return 0;
    const uint64_t ticks = ((uint64_t)kernel.dwHighDateTime << 32 | kernel.dwLowDateTime) +
                           ((uint64_t)user.dwHighDateTime << 32 | user.dwLowDateTime);
    return 1e-7 * (double)ticks;
}

/* The clock of a thread has steps of 10 to 16 ms. Within a step, the time on the wall since this thread first saw it
 * counts, and the less the longer it is: others may have had the processor. So a short run has a time above zero. */
double kmp_cpu_now(void)
{
    static _Thread_local double step, seen, last;
    const double least = 0.01, now = seconds_of(GetCurrentThread()), wall = kmp_wall_now();
    if (seen == 0 || now != step) {
        step = now;
        seen = wall;
    }
    last = fmax(last, now + least * (wall - seen) / (wall - seen + least));
    return last;
}

double kmp_thread_cpu(pthread_t thread)
{
    return seconds_of(pthread_gethandle(thread));
}

double kmp_wall_now(void)
{
    LARGE_INTEGER frequency, count;
    QueryPerformanceFrequency(&frequency);
    QueryPerformanceCounter(&count);
    return (double)count.QuadPart / (double)frequency.QuadPart;
}

/* -- memory ------------------------------------------------------------------------------------------ */

void *kmp_pages_new(const void *code, size_t size)
{
    DWORD before;
    void *pages = size > 0 ? VirtualAlloc(NULL, size, MEM_COMMIT | MEM_RESERVE, PAGE_READWRITE) : NULL;
    if (!pages)
        return NULL;
    memcpy(pages, code, size);
    if (VirtualProtect(pages, size, PAGE_EXECUTE_READ, &before) &&
        FlushInstructionCache(GetCurrentProcess(), pages, size))
        return pages;
    kmp_pages_free(pages, size);
    return NULL;
}

void kmp_pages_free(void *pages, size_t size)
{
    (void)size;
    if (pages)
        (void)VirtualFree(pages, 0, MEM_RELEASE);
}

size_t kmp_heap_in_use(void)
{
    return 0;
}

/* -- threads ----------------------------------------------------------------------------------------- */

bool kmp_thread_start(pthread_t *thread, void *(*run)(void *user), void *user)
{
    pthread_attr_t attributes;
    if (pthread_attr_init(&attributes) != 0)
        return false;
    (void)pthread_attr_setstacksize(&attributes, KMP_THREAD_STACK);
    const bool started = pthread_create(thread, &attributes, run, user) == 0;
    (void)pthread_attr_destroy(&attributes);
    return started;
}

bool kmp_thread_start_deaf(pthread_t *thread, void *(*run)(void *user), void *user)
{
    return kmp_thread_start(thread, run, user);
}

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
    DWORD_PTR own = 0, all = 0;
    if (!GetProcessAffinityMask(GetCurrentProcess(), &own, &all) || own == 0)
        return 1;
    int count = 0;
    for (; own; own &= own - 1)
        count++;
    return count;
}

/* -- processes --------------------------------------------------------------------------------------- */

long kmp_process_number(void)
{
    return (long)GetCurrentProcessId();
}

unsigned long long kmp_process_start(long process)
{
    FILETIME made, ended, kernel, user;
    DWORD code = 0;
    HANDLE handle = OpenProcess(PROCESS_QUERY_LIMITED_INFORMATION, FALSE, (DWORD)process);
    const bool runs = handle && GetExitCodeProcess(handle, &code) && code == STILL_ACTIVE &&
                      GetProcessTimes(handle, &made, &ended, &kernel, &user);
    if (handle)
        CloseHandle(handle);
    return runs ? (unsigned long long)made.dwHighDateTime << 32 | made.dwLowDateTime : 0;
}

void kmp_system_word(char word[KMP_SYSTEM_WORD])
{
    wchar_t wide[MAX_COMPUTERNAME_LENGTH + 1];
    char name[3 * MAX_COMPUTERNAME_LENGTH + 1] = "";
    DWORD size = MAX_COMPUTERNAME_LENGTH + 1;
    if (!GetComputerNameW(wide, &size) || !narrow(wide, name, sizeof name))
        name[0] = '\0';
    for (char *s = name; *s; s++)
        *s = (unsigned char)*s <= ' ' ? '_' : *s;
    (void)snprintf(word, KMP_SYSTEM_WORD, "%s/windows", name);
}

/* A word of a command line: between quotation marks, with backslashes before those and before the end doubled. */
static char *put_word(char *at, const char *word)
{
    *at++ = '"';
    for (size_t run = 0;; word++) {
        if (*word == '\\') {
            run++;
        } else {
            const bool doubled = *word == '"' || !*word;
            for (size_t k = 0; k < (doubled ? 2 * run : run); k++)
                *at++ = '\\';
            run = 0;
            if (!*word)
                break;
            if (*word == '"')
                *at++ = '\\';
            *at++ = *word;
        }
    }
    *at++ = '"';
    *at++ = ' ';
    *at = '\0';
    return at;
}

/* The command line of words; NULL: no memory. The caller frees it. */
static wchar_t *line_of(char *const *words)
{
    size_t size = 1;
    for (int k = 0; words[k]; k++)
        size += 2 * strlen(words[k]) + 4;
    char *line = calloc(size, 1), *at = line;
    for (int k = 0; line && words[k]; k++)
        at = put_word(at, words[k]);
    wchar_t *wide = line ? widened(line) : NULL;
    free(line);
    return wide;
}

/* A new file that a program writes to. */
static HANDLE file_for(const char *path)
{
    wide_path output;
    SECURITY_ATTRIBUTES inherited = {sizeof inherited, NULL, TRUE};
    return path && widen(path, output) ? CreateFileW(output, GENERIC_WRITE, FILE_SHARE_READ, &inherited, CREATE_ALWAYS,
                                                     FILE_ATTRIBUTE_NORMAL, NULL)
                                       : INVALID_HANDLE_VALUE;
}

int kmp_process_run(char *const *words, const char *said)
{
    wchar_t *wide = line_of(words);
    HANDLE file = file_for(said);
    STARTUPINFOW start = {.cb = sizeof start};
    if (file != INVALID_HANDLE_VALUE) {
        start.dwFlags = STARTF_USESTDHANDLES;
        start.hStdInput = GetStdHandle(STD_INPUT_HANDLE);
        start.hStdOutput = start.hStdError = file;
    }
    PROCESS_INFORMATION process = {0};
    DWORD code = (DWORD)-1;
    if (wide && (!said || file != INVALID_HANDLE_VALUE) &&
        CreateProcessW(NULL, wide, NULL, NULL, TRUE, 0, NULL, NULL, &start, &process)) {
        (void)WaitForSingleObject(process.hProcess, INFINITE);
        (void)GetExitCodeProcess(process.hProcess, &code);
        CloseHandle(process.hProcess);
        CloseHandle(process.hThread);
    }
    if (file != INVALID_HANDLE_VALUE)
        CloseHandle(file);
    free(wide);
    return (int)code;
}

struct kmp_process {
    PROCESS_INFORMATION at;
    bool asked;
};

kmp_process *kmp_process_begin(char *const *words, const char *folder, const char *said, const char *complained)
{
    wide_path in;
    wchar_t *wide = line_of(words);
    HANDLE files[2] = {file_for(said), file_for(complained)};
    STARTUPINFOW start = {.cb = sizeof start, .dwFlags = STARTF_USESTDHANDLES};
    start.hStdOutput = files[0];
    start.hStdError = files[1];
    kmp_process *process = calloc(1, sizeof *process);
    const bool ok =
        process && wide && files[0] != INVALID_HANDLE_VALUE && files[1] != INVALID_HANDLE_VALUE && widen(folder, in) &&
        CreateProcessW(NULL, wide, NULL, NULL, TRUE, CREATE_NEW_PROCESS_GROUP, NULL, in, &start, &process->at);
    for (int k = 0; k < 2; k++)
        if (files[k] != INVALID_HANDLE_VALUE)
            CloseHandle(files[k]);
    free(wide);
    if (ok)
        return process;
    free(process);
    return NULL;
}

bool kmp_process_has_ended(kmp_process *process, int *code)
{
    DWORD exit_code = 0;
    if (WaitForSingleObject(process->at.hProcess, 0) != WAIT_OBJECT_0)
        return false;
    (void)GetExitCodeProcess(process->at.hProcess, &exit_code);
    *code = (int)exit_code;
    return true;
}

void kmp_process_interrupt(kmp_process *process)
{
    if (!process->asked)
        (void)GenerateConsoleCtrlEvent(CTRL_BREAK_EVENT, process->at.dwProcessId);
    process->asked = true;
}

void kmp_process_end(kmp_process *process)
{
    int code;
    if (process && !kmp_process_has_ended(process, &code))
        (void)TerminateProcess(process->at.hProcess, 1);
    if (process) {
        CloseHandle(process->at.hProcess);
        CloseHandle(process->at.hThread);
    }
    free(process);
}

/* Connections need a library that builds for Windows are without. */
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

bool kmp_secret(void *bytes, size_t size)
{
    unsigned char *at = bytes;
    for (size_t k = 0; k < size; k++) {
        unsigned number;
        if (rand_s(&number) != 0)
            return false;
        at[k] = (unsigned char)number;
    }
    return true;
}

const char *kmp_page_opener(void)
{
    return "the program for pages";
}

bool kmp_page_open(const char *path)
{
    wide_path wide;
    return widen(path, wide) && (intptr_t)ShellExecuteW(NULL, L"open", wide, NULL, NULL, SW_SHOWNORMAL) > 32;
}

/* The linker's time and sum of a module, and the identity that it gave its build (--build-id), in the directory of
 * debug data. */
static bool report_module(HMODULE module, kmp_identity_part *part, void *user)
{
    const unsigned char *at = (const unsigned char *)module;
    IMAGE_DOS_HEADER dos;
    IMAGE_NT_HEADERS64 head;
    if (!module)
        return false;
    memcpy(&dos, at, sizeof dos);
    memcpy(&head, at + dos.e_lfanew, sizeof head);
    part(user, NULL, &head.FileHeader, sizeof head.FileHeader);
    part(user, NULL, &head.OptionalHeader.CheckSum, sizeof head.OptionalHeader.CheckSum);
    part(user, NULL, &head.OptionalHeader.SizeOfImage, sizeof head.OptionalHeader.SizeOfImage);
    const IMAGE_DATA_DIRECTORY list = head.OptionalHeader.DataDirectory[IMAGE_DIRECTORY_ENTRY_DEBUG];
    for (DWORD k = 0; k + sizeof(IMAGE_DEBUG_DIRECTORY) <= list.Size; k += sizeof(IMAGE_DEBUG_DIRECTORY)) {
        IMAGE_DEBUG_DIRECTORY entry;
        memcpy(&entry, at + list.VirtualAddress + k, sizeof entry);
        if (entry.Type != IMAGE_DEBUG_TYPE_CODEVIEW || entry.AddressOfRawData == 0)
            continue;
        part(user, NULL, at + entry.AddressOfRawData, entry.SizeOfData);
        return true;
    }
    return false;
}

bool kmp_build_identity(kmp_identity_part *part, void *user)
{
    HMODULE own = NULL;
    (void)GetModuleHandleExW(GET_MODULE_HANDLE_EX_FLAG_FROM_ADDRESS | GET_MODULE_HANDLE_EX_FLAG_UNCHANGED_REFCOUNT,
                             (LPCWSTR)(uintptr_t)&kmp_build_identity, &own);
    (void)report_module(GetModuleHandleW(L"msvcrt.dll"), part, user);
    return report_module(own, part, user);
}

/* -- signals ----------------------------------------------------------------------------------------- */

void kmp_interrupts_to(void (*handler)(int number))
{
    (void)signal(SIGINT, handler); /* a delivered one is back to ending the process */
    (void)signal(SIGTERM, handler);
}

void kmp_interrupt_guard(void (*handler)(void))
{
    (void)handler;
}

void kmp_interrupt_guard_end(void)
{
}

/* -- libraries --------------------------------------------------------------------------------------- */

/* A name without a folder is not looked for in the working folder, in which anybody may have put such a file. */
void *kmp_library_open(const char *name)
{
    wide_path wide;
    if (!name)
        return GetModuleHandleW(NULL);
    if (!widen(name, wide))
        return NULL;
    return kmp_path_folder(name) > 0 ? LoadLibraryW(wide)
                                     : LoadLibraryExW(wide, NULL, LOAD_LIBRARY_SEARCH_DEFAULT_DIRS);
}

void *kmp_library_find(void *library, const char *symbol)
{
    const FARPROC found = GetProcAddress(library, symbol);
    void *address;
    memcpy(&address, &found, sizeof address);
    return address;
}

void kmp_library_close(void *library)
{
    if (library != GetModuleHandleW(NULL))
        (void)FreeLibrary(library);
}

const char *kmp_library_reason(void)
{
    static _Thread_local char words[80];
    (void)snprintf(words, sizeof words, "error %lu of the system's loader", GetLastError());
    return words;
}

const char kmp_library_ending[] = ".dll";

const char *kmp_platform_of_units(int fmi)
{
    return fmi == 2 ? "win64" : "x86_64-windows";
}

/* -- the command ------------------------------------------------------------------------------------- */

void kmp_command_begin(int *count, char ***words)
{
    int given = 0;
    wchar_t **wide = CommandLineToArgvW(GetCommandLineW(), &given);
    char **own = wide ? calloc((size_t)given + 1, sizeof *own) : NULL;
    for (int k = 0; own && k < given; k++) {
        const int size = WideCharToMultiByte(CP_UTF8, 0, wide[k], -1, NULL, 0, NULL, NULL);
        own[k] = calloc((size_t)(size > 0 ? size : 1), 1);
        if (own[k])
            (void)narrow(wide[k], own[k], size);
    }
    if (own) { /* until the end of the process */
        *count = given;
        *words = own;
    }
    (void)LocalFree(wide);
    (void)_setmode(0, _O_BINARY);
    (void)_setmode(1, _O_BINARY);
    (void)_setmode(2, _O_BINARY);
    (void)SetConsoleOutputCP(CP_UTF8);
    DWORD mode;
    HANDLE screen = GetStdHandle(STD_ERROR_HANDLE);
    if (GetConsoleMode(screen, &mode)) /* progress replaces its line */
        (void)SetConsoleMode(screen, mode | ENABLE_VIRTUAL_TERMINAL_PROCESSING);
}

void kmp_command_keep_memory(void)
{
}

bool kmp_is_terminal(FILE *stream)
{
    DWORD mode;
    return GetConsoleMode(handle_of(_fileno(stream)), &mode) != 0;
}

int kmp_terminal_width(void)
{
    CONSOLE_SCREEN_BUFFER_INFO screen;
    return GetConsoleScreenBufferInfo(GetStdHandle(STD_ERROR_HANDLE), &screen)
               ? screen.srWindow.Right - screen.srWindow.Left + 1
               : 0;
}
