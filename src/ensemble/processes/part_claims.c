/* SPDX-License-Identifier: BSD-3-Clause */
#include "ensemble/processes/part_claims.h"
#include "base/file.h"
#include "base/memory.h"
#include "base/thread_pool.h"
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <pthread.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

static const char subfolder[] = "claims", unfinished[] = ".tmp-";

struct kmp_claims {
    kempe_context *context;
    kmp_text folder; /* of the claims */
    kmp_text owner;  /* content of the claims of this process */
    kmp_text held;   /* path; empty: none */
    pthread_t beat;
    pthread_mutex_t lock; /* of `held` and `ends` */
    pthread_cond_t wake;
    bool has_beat, ends;
};

/* -- processes --------------------------------------------------------------------------------------- */

/* The start time of a process in clock ticks (proc_pid_stat(5), field 22); 0: it does not run, or is a zombie. */
static unsigned long long start_of(long process)
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

/* -- claims of others -------------------------------------------------------------------------------- */

/* Seconds since the last touch of a file by the clock of its file system; negative: unknown. */
static double age_of(kmp_claims *c, const char *path)
{
    struct stat about, now;
    kmp_text probe = {0};
    double age = -1;
    kmp_text_printf(&probe, "%s/now%s%ld-XXXXXX", c->folder.s, unfinished, (long)getpid());
    int fd = probe.failed ? -1 : mkstemp(probe.s);
    if (fd >= 0) {
        if (fstat(fd, &now) == 0 && stat(path, &about) == 0)
            age = (double)(now.st_mtim.tv_sec - about.st_mtim.tv_sec);
        close(fd);
        unlink(probe.s);
    }
    kmp_text_free(&probe);
    return age;
}

/* True if the owner of a claim has ended. */
static bool is_stale(kmp_claims *c, const char *path, const char *content)
{
    long process = 0;
    unsigned long long start = 0;
    size_t host = strcspn(content, " ");
    bool here = strncmp(content, c->owner.s, host + 1) == 0 && content[host] == ' ';
    if (here && sscanf(content + host, " %ld %llu", &process, &start) == 2)
        return start_of(process) != start;
    return age_of(c, path) > KMP_CLAIM_STALE;
}

/* Removes a claim whose owner has ended. It takes another name first: of several processes that try, one does. */
static bool remove_stale(kmp_claims *c, const char *path)
{
    char *content = NULL;
    size_t length;
    kmp_text name = {0};
    bool removed = false;
    if (kmp_file_read(c->context, KMP_FILE_RECORD, path, &content, &length) != KEMPE_OK) {
        kmp_context_clear(c->context);
        return access(path, F_OK) != 0; /* its owner has released it */
    }
    if (is_stale(c, path, content)) {
        kmp_text_printf(&name, "%s%sold-%ld", path, unfinished, (long)getpid());
        removed = !name.failed && rename(path, name.s) == 0 && unlink(name.s) == 0;
    }
    kmp_text_free(&name);
    kmp_free(content);
    return removed;
}

/* -- own claims -------------------------------------------------------------------------------------- */

/* Touches the claim from time to time, so that other hosts see that its owner lives. */
static void *beat(void *self)
{
    kmp_claims *c = self;
    pthread_mutex_lock(&c->lock);
    while (!c->ends) {
        struct timespec until;
        clock_gettime(CLOCK_REALTIME, &until);
        until.tv_sec += KMP_CLAIM_BEAT;
        (void)pthread_cond_timedwait(&c->wake, &c->lock, &until);
        if (c->held.length > 0)
            (void)utimensat(AT_FDCWD, c->held.s, NULL, 0);
    }
    pthread_mutex_unlock(&c->lock);
    return NULL;
}

/* Signals go to the other threads. */
static bool start_beat(kmp_claims *c)
{
    sigset_t all, old;
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &old);
    c->has_beat = kmp_thread_start(&c->beat, beat, c);
    pthread_sigmask(SIG_SETMASK, &old, NULL);
    return c->has_beat;
}

kempe_status kmp_claims_new(kempe_context *context, const char *folder, kmp_claims **claims)
{
    KMP_MAKE(context, kmp_claims, c);
    c->context = context;
    pthread_mutex_init(&c->lock, NULL);
    pthread_cond_init(&c->wake, NULL);
    kmp_text_printf(&c->folder, "%s/%s", folder, subfolder);
    /* Appends a word that processes share whose numbers have one meaning: host, start of its system, space of numbers.
     */
    kmp_text *text = &c->owner;
    char name[HOST_NAME_MAX + 1] = "", boot[40] = "", space[64] = "";
    (void)gethostname(name, sizeof name - 1);
    FILE *file = fopen("/proc/sys/kernel/random/boot_id", "r");
    if (file) {
        boot[strcspn(fgets(boot, sizeof boot, file) ? boot : "", "\n")] = '\0';
        fclose(file);
    }
    ssize_t length = readlink("/proc/self/ns/pid", space, sizeof space - 1);
    space[length > 0 ? length : 0] = '\0';
    for (char *s = name; *s; s++)
        *s = (unsigned char)*s <= ' ' ? '_' : *s;
    kmp_text_printf(text, "%s/%s/%s", name, boot, space);
    kmp_text_printf(&c->owner, " %ld %llu\n", (long)getpid(), start_of((long)getpid()));
    kempe_status status = kmp_made(context, !c->folder.failed && !c->owner.failed);
    if (status == KEMPE_OK)
        status = kmp_folder_make(context, c->folder.s);
    if (status == KEMPE_OK)
        status = kmp_made(context, start_beat(c));
    return KMP_GIVE_OR_FREE(status, claims, c, kmp_claims_free);
}

void kmp_claims_free(kmp_claims *c)
{
    if (!c)
        return;
    kmp_claims_release(c);
    if (c->has_beat) {
        pthread_mutex_lock(&c->lock);
        c->ends = true;
        pthread_cond_signal(&c->wake);
        pthread_mutex_unlock(&c->lock);
        pthread_join(c->beat, NULL);
    }
    if (c->folder.length > 0)
        (void)rmdir(c->folder.s); /* fails where others have claims */
    pthread_cond_destroy(&c->wake);
    pthread_mutex_destroy(&c->lock);
    kmp_text_free(&c->folder);
    kmp_text_free(&c->owner);
    kmp_text_free(&c->held);
    kmp_free(c);
}

static void hold(kmp_claims *c, kmp_text path)
{
    pthread_mutex_lock(&c->lock);
    kmp_text_free(&c->held);
    c->held = path;
    pthread_mutex_unlock(&c->lock);
}

/* Makes the claim, and its folder again where another process has removed it with its own last claim. */
static kempe_status make_claim(kmp_claims *c, const char *path, bool *taken)
{
    enum { TRIES = 3 };
    kempe_status status = KEMPE_OK;
    *taken = false;
    for (int k = 0; k < TRIES && !*taken; k++) {
        status = kmp_file_make(c->context, path, c->owner.s, false, taken);
        if (status == KEMPE_OK && !*taken && !remove_stale(c, path))
            return KEMPE_OK;
        if (status == KEMPE_E_IO && access(c->folder.s, F_OK) != 0) {
            kmp_context_clear(c->context);
            status = kmp_folder_make(c->context, c->folder.s);
        }
        if (status != KEMPE_OK)
            return status;
    }
    return status;
}

kempe_status kmp_claims_take(kmp_claims *c, int part, bool *taken)
{
    kmp_text path = {0};
    kmp_text_printf(&path, "%s/%06d", c->folder.s, part);
    kempe_status status = kmp_made(c->context, !path.failed);
    *taken = false;
    if (status == KEMPE_OK)
        status = make_claim(c, path.s, taken);
    if (*taken)
        hold(c, path);
    else
        kmp_text_free(&path);
    return status;
}

void kmp_claims_release(kmp_claims *c)
{
    if (c->held.length > 0)
        (void)unlink(c->held.s);
    hold(c, (kmp_text){0});
}

/* -- the end ----------------------------------------------------------------------------------------- */

/* Removes the files of a folder whose names have `part` (all: NULL). */
static void remove_files(const char *path, const char *part)
{
    DIR *folder = opendir(path);
    struct stat about;
    for (const struct dirent *d = folder ? readdir(folder) : NULL; d; d = readdir(folder))
        if ((!part || strstr(d->d_name, part)) && fstatat(dirfd(folder), d->d_name, &about, AT_SYMLINK_NOFOLLOW) == 0 &&
            S_ISREG(about.st_mode))
            (void)unlinkat(dirfd(folder), d->d_name, 0);
    if (folder)
        closedir(folder);
}

void kmp_claims_clear(const char *folder)
{
    kmp_text path = {0};
    kmp_text_printf(&path, "%s/%s", folder, subfolder);
    if (!path.failed) {
        remove_files(path.s, NULL);
        (void)rmdir(path.s);
        remove_files(folder, unfinished);
    }
    kmp_text_free(&path);
}
