/* SPDX-License-Identifier: BSD-3-Clause */
/* A context that reads only within a folder: its files, files in folders of it, and given texts; nothing beyond it. */
#include "testing.h"
#include <kempe/kempe.h>
#include <kempe/settings.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const char bar[] = "kempe: 1\nbodies:\n  a: {joint: {revolute: z, at: ground}, mass: 1, inertia: {zz: 1}}\n";

static void put(const char *folder, const char *name, const char *text)
{
    char path[256];
    (void)snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *file = fopen(path, "w");
    CHECK(file && fputs(text, file) >= 0 && fclose(file) == 0);
}

static kempe_status read_in(kempe_context *context, const char *folder, const char *name)
{
    char path[256];
    kempe_model *model = NULL;
    (void)snprintf(path, sizeof path, "%s/%s", folder, name);
    const kempe_status status = kempe_model_read(context, path, &model);
    kempe_model_free(model);
    return status;
}

static void only_the_folder_is_read(void)
{
    char folder[] = "/tmp/kempe-folder-XXXXXX", path[256], target[256];
    kempe_context *context = kempe_context_new();
    CHECK(mkdtemp(folder) != NULL);
    (void)snprintf(path, sizeof path, "mkdir -p %s/in/deep %s/inside", folder, folder);
    CHECK(system(path) == 0);
    put(folder, "out.yaml", bar);
    put(folder, "inside/near.yaml", bar);
    put(folder, "in/own.yaml", bar);
    put(folder, "in/deep/own.yaml", bar);
    (void)snprintf(path, sizeof path, "%s/in/link.yaml", folder);
    (void)snprintf(target, sizeof target, "%s/out.yaml", folder);
    CHECK(symlink(target, path) == 0);
    (void)snprintf(path, sizeof path, "%s/in", folder);
    CHECK(kempe_context_set_folder(context, "/no/such/folder") == KEMPE_E_IO);
    CHECK(read_in(context, folder, "out.yaml") == KEMPE_OK);
    CHECK(kempe_context_set_folder(context, path) == KEMPE_OK);
    CHECK(read_in(context, folder, "in/own.yaml") == KEMPE_OK);
    CHECK(read_in(context, folder, "in/deep/own.yaml") == KEMPE_OK);
    static const char *const beyond[] = {"out.yaml", "in/../out.yaml", "in/link.yaml", "inside/near.yaml"};
    for (size_t k = 0; k < sizeof beyond / sizeof *beyond; k++) {
        CHECK(read_in(context, folder, beyond[k]) == KEMPE_E_IO);
        CHECK(strstr(kempe_context_message(context), "only files in the folder"));
    }
    CHECK(kempe_context_set_text(context, "/elsewhere.yaml", bar) == KEMPE_OK);
    CHECK(read_in(context, "", "elsewhere.yaml") == KEMPE_OK);
    CHECK(kempe_context_set_folder(context, NULL) == KEMPE_OK);
    CHECK(read_in(context, folder, "out.yaml") == KEMPE_OK);
    kempe_context_free(context);
    (void)snprintf(path, sizeof path, "rm -r %s", folder);
    CHECK(system(path) == 0);
}

int main(void)
{
    TEST(only_the_folder_is_read);
    return check_report();
}
