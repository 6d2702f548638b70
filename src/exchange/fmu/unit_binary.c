/* SPDX-License-Identifier: BSD-3-Clause */
#include "exchange/fmu/unit_binary.h"
#include "base/context.h"
#include "base/file.h"
#include "base/memory.h"
#include "platform/platform.h"
#include <string.h>

/* -- platforms ------------------------------------------------------------------------------------------- */

static const kmp_unit_platform platforms[KMP_UNIT_PLATFORMS] = {
    {"x86_64-linux", "linux64", ".so", "x86_64-linux-gnu-gcc", "a cross-compiler (Debian: gcc-x86-64-linux-gnu)",
     false},
    {"x86_64-windows", "win64", ".dll", "x86_64-w64-mingw32-gcc", "mingw-w64 (Debian: gcc-mingw-w64-x86-64)", true},
    {"aarch64-linux", "aarch64-linux", ".so", "aarch64-linux-gnu-gcc",
     "a cross-compiler (Debian: gcc-aarch64-linux-gnu)", false},
    {"x86_64-darwin", "darwin64", ".dylib", NULL, NULL, false},
    {"aarch64-darwin", "darwin64", ".dylib", NULL, NULL, false},
};

bool kmp_unit_is_own(const kmp_unit_platform *platform)
{
    return strcmp(platform->name, kmp_platform_of_units(3)) == 0;
}

const char *kmp_unit_folder(const kmp_unit_platform *platform, int fmi)
{
    return fmi == 2 ? platform->second : platform->name;
}

static const kmp_unit_platform *find(const char *name, size_t length)
{
    for (int k = 0; k < KMP_UNIT_PLATFORMS; k++)
        if (strlen(platforms[k].name) == length && strncmp(platforms[k].name, name, length) == 0)
            return &platforms[k];
    return NULL;
}

/* One word of the list, after `count` platforms. */
static kempe_status read_one(kempe_context *context, const kempe_fmu_options *o, const char *name, size_t length,
                             const kmp_unit_platform **list, int count)
{
    const kmp_unit_platform *platform = find(name, length);
    if (!platform)
        return kmp_fail(context, KEMPE_E_ARGUMENT,
                        "unknown platform '%.*s' of a unit; platforms are x86_64-linux, x86_64-windows, aarch64-linux, "
                        "x86_64-darwin and aarch64-darwin",
                        (int)length, name);
    for (int k = 0; k < count; k++)
        if (list[k] == platform)
            return kmp_fail(context, KEMPE_E_ARGUMENT, "the platform '%s' is named twice", platform->name);
        else if (o->fmi == 2 && strcmp(list[k]->second, platform->second) == 0)
            return kmp_fail(context, KEMPE_E_ARGUMENT,
                            "FMI 2.0 has one name for '%s' and '%s': name one of them, or use version 3", list[k]->name,
                            platform->name);
    if (!o->compiler && !o->unit_file && !platform->compiler && !kmp_unit_is_own(platform))
        return kmp_fail(context, KEMPE_E_ARGUMENT,
                        "binaries for %s are made on macOS only, or by a compiler that --compiler names",
                        platform->name);
    list[count] = platform;
    return KEMPE_OK;
}

kempe_status kmp_unit_platforms_read(kempe_context *context, const kempe_fmu_options *o, const kmp_unit_platform **list,
                                     int *count)
{
    const char *own = kmp_platform_of_units(3), *words = o->platforms ? o->platforms : own;
    if (!*words)
        return kmp_fail(context, KEMPE_E_ARGUMENT,
                        o->platforms ? "the platforms of the unit are missing: x86_64-linux,x86_64-windows for instance"
                                     : "binaries of units are not made on this platform: use --no-binary");
    *count = 0;
    for (const char *word = words;; word++) {
        const size_t length = strcspn(word, ",");
        KMP_TRY(read_one(context, o, word, length, list, *count));
        ++*count;
        word += length;
        if (!*word)
            break;
    }
    if (o->compiler && *count > 1)
        return kmp_fail(
            context, KEMPE_E_ARGUMENT,
            "the compiler '%s' makes a binary for one platform, and %d are named: leave it out, or name one",
            o->compiler, *count);
    return KEMPE_OK;
}

const char *kmp_unit_library_of(kmp_arena *arena, const char *own_file, const kmp_unit_platform *platform)
{
    if (kmp_unit_is_own(platform))
        return own_file;
    const size_t folder = kmp_path_folder(own_file);
    return kmp_arena_printf(arena, "%.*skempe_unit-%s%s", (int)folder, own_file, platform->name, platform->ending);
}

/* -- compilers ------------------------------------------------------------------------------------------- */

enum { MOST_WORDS = 64, MOST_SHOWN = 160 };

static const char *package_of(const kmp_unit_platform *platform)
{
    if (!kmp_unit_is_own(platform))
        return platform->package ? platform->package : "it";
    return platform->is_windows ? "mingw-w64 (w64devkit, WinLibs or MSYS2 have it)" : "one";
}

static char *path_in(kmp_arena *arena, const char *folder, const char *name)
{
    return kmp_arena_printf(arena, "%s/%s", folder, name);
}

/* The first line of the compiler's output that says error, otherwise the first one. */
static kempe_status report_failure(kempe_context *context, const char *compiler, const kmp_unit_platform *platform,
                                   int code, const char *said)
{
    char *text = NULL;
    size_t length = 0;
    if (code < 0 || code == 127)
        return kmp_fail(
            context, KEMPE_E_FAILED,
            "the C compiler '%s' for %s does not run: install %s, name another with --compiler, or write the unit "
            "without a binary with --no-binary",
            compiler, platform->name, package_of(platform));
    if (kmp_file_read(context, KMP_FILE_RECORD, said, &text, &length) != KEMPE_OK)
        text = NULL;
    const char *line = text ? strstr(text, "error") : NULL;
    while (line && line > text && line[-1] != '\n')
        line--;
    line = line ? line : text ? text : "";
    kempe_status status = kmp_fail(
        context, KEMPE_E_FAILED, "the C compiler '%s' fails with exit code %d: %.*s; --no-binary does without it",
        compiler, code, (int)(strcspn(line, "\n") < MOST_SHOWN ? strcspn(line, "\n") : MOST_SHOWN), line);
    kmp_free(text);
    return status;
}

/* Options that all compilers take; of libraries of Windows: printf of C99, no DLL of the
 * compiler, no time in the file; of all others. */
static char *const all_options[] = {"-std=gnu99", "-O2", "-ffp-contract=off", "-shared", "-fvisibility=hidden", "-s"};
static char *const windows_options[] = {"-D__USE_MINGW_ANSI_STDIO=1", "-static", "-Wl,--no-insert-timestamp"};
static char *const other_options[] = {"-fPIC"};

static kempe_status build(kempe_context *context, kmp_arena *arena, const char *folder, const kmp_unit_plan *plan,
                          const kmp_unit_platform *platform, const char *compiler, kmp_text *bytes)
{
    char *words[MOST_WORDS], *text = NULL;
    int count = 0;
    size_t length = 0;
    char *out = path_in(arena, folder, "unit.so"), *said = path_in(arena, folder, "said.txt");
    words[count++] = kmp_arena_strdup(arena, compiler);
    for (size_t k = 0; k < sizeof all_options / sizeof *all_options; k++)
        words[count++] = all_options[k];
    for (size_t k = 0; platform->is_windows && k < sizeof windows_options / sizeof *windows_options; k++)
        words[count++] = windows_options[k];
    for (size_t k = 0; !platform->is_windows && k < sizeof other_options / sizeof *other_options; k++)
        words[count++] = other_options[k];
    words[count++] = kmp_arena_strdup(arena, "-o");
    words[count++] = out;
    for (int k = 0; k < plan->source_count && count < MOST_WORDS - 2; k++)
        words[count++] = path_in(arena, folder, plan->sources[k]);
    words[count++] = kmp_arena_strdup(arena, "-lm");
    words[count] = NULL;
    if (arena->failed)
        return kmp_fail_memory(context);
    int code = kmp_process_run(words, said);
    if (code != 0)
        return report_failure(context, compiler, platform, code, said);
    KMP_TRY(kmp_file_read(context, KMP_FILE_BINARY, out, &text, &length));
    kmp_text_append(bytes, text, length);
    kmp_free(text);
    return kmp_made(context, !bytes->failed);
}

static void remove_folder(kmp_arena *arena, const kmp_code_files *files, const char *folder)
{
    static const char *const made[] = {"unit.so", "said.txt"};
    for (int k = 0; k < files->count; k++) {
        char *path = path_in(arena, folder, files->file[k].name);
        if (path)
            (void)kmp_path_remove(path);
    }
    for (size_t k = 0; k < sizeof made / sizeof *made; k++) {
        char *path = path_in(arena, folder, made[k]);
        if (path)
            (void)kmp_path_remove(path);
    }
    (void)kmp_folder_remove(folder);
}

kempe_status kmp_unit_compile(kempe_context *context, const kmp_code_files *files, const kmp_unit_plan *plan,
                              const kmp_unit_platform *platform, const char *compiler, kmp_text *bytes)
{
    kmp_arena arena = {0};
    char above[KMP_PATH_MOST];
    if (!compiler) /* mingw-w64 has no cc; else the package of the compiler, for sentences */
        compiler = !kmp_unit_is_own(platform) ? platform->compiler : platform->is_windows ? "gcc" : "cc";
    kmp_path_temporary(above);
    char *folder = kmp_arena_printf(&arena, "%s/kempe-XXXXXX", above);
    kempe_status status = folder ? KEMPE_OK : kmp_fail_memory(context);
    if (status == KEMPE_OK && !kmp_folder_temporary(folder)) {
        status = kmp_fail(context, KEMPE_E_IO, "cannot make a folder in '%s' for the compiler", above);
    } else if (status == KEMPE_OK) {
        for (int k = 0; k < files->count && status == KEMPE_OK; k++) {
            char *path = path_in(&arena, folder, files->file[k].name);
            status = path ? kempe_write_file(context, path, files->file[k].text.s) : kmp_fail_memory(context);
        }
        if (status == KEMPE_OK)
            status = build(context, &arena, folder, plan, platform, compiler, bytes);
        remove_folder(&arena, files, folder);
    }
    kmp_arena_free(&arena);
    return status == KEMPE_E_IO ? KEMPE_E_FAILED : status; /* files that the caller has not named */
}
