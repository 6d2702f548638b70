/* SPDX-License-Identifier: BSD-3-Clause */
/* A target without libFuzzer: runs it with every file of the folders and with the files given. */
#include "fuzz.h"
#include <dirent.h>
#include <stdio.h>
#include <sys/stat.h>

static int inputs;

static bool run_file(const char *path)
{
    FILE *stream = fopen(path, "rb");
    struct stat about;
    if (!stream || fstat(fileno(stream), &about) != 0) {
        fprintf(stderr, "cannot read '%s'\n", path);
        return false;
    }
    size_t size = (size_t)about.st_size;
    uint8_t *data = malloc(size ? size : 1); /* as long as the input, so that reading beyond it is seen */
    bool ok = data && fread(data, 1, size, stream) == size;
    fclose(stream);
    if (ok)
        (void)LLVMFuzzerTestOneInput(data, size);
    inputs++;
    free(data);
    return ok;
}

static int is_seen(const struct dirent *entry)
{
    return entry->d_name[0] != '.';
}

static bool run_folder(const char *path)
{
    struct dirent **entries;
    int count = scandir(path, &entries, is_seen, alphasort);
    bool ok = count > 0;
    for (int k = 0; k < count; k++) {
        char name[4096];
        snprintf(name, sizeof name, "%s/%s", path, entries[k]->d_name);
        ok = run_file(name) && ok;
        free(entries[k]);
    }
    if (count >= 0)
        free(entries);
    return ok;
}

int main(int argc, char **argv)
{
    bool ok = argc > 1;
    for (int k = 1; k < argc; k++) {
        struct stat about;
        bool folder = stat(argv[k], &about) == 0 && S_ISDIR(about.st_mode);
        ok = (folder ? run_folder : run_file)(argv[k]) && ok;
    }
    printf("%d inputs\n", inputs);
    return ok ? 0 : 1;
}
