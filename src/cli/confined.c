/* SPDX-License-Identifier: BSD-3-Clause */
#include "confined.h"
#include "command.h"
#include "terminal.h"

#include <kempe/settings.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_PATH = 4096 };

/* Commands that read a model, compute and end, and start no other program. */
static const unsigned taken = CLI_ASSEMBLE | CLI_CHECK | CLI_COMFORT | CLI_COMPARE | CLI_CONTACT | CLI_CYCLES |
                              CLI_EQUILIBRIUM | CLI_FIT | CLI_INVERSE | CLI_KINEMATICS | CLI_LINEARIZE | CLI_MODES |
                              CLI_OPTIMIZE | CLI_RESPONSE | CLI_SENSITIVITY | CLI_SHOW | CLI_SIMULATE;

static const char *folder, *scratch; /* NULL: nothing is confined */
static char **names;
static int name_count;

bool cli_is_confined(void)
{
    return scratch;
}

/* A path in the scratch folder. */
static const char *in_scratch(const char *name, int number)
{
    static char path[MOST_PATH];
    (void)snprintf(path, sizeof path, number < 0 ? "%s/%s" : "%s/%s%d", scratch, name, number);
    return path;
}

/* Words without the names of the two folders, also behind the sign of an option. */
static char *without_folder(char *word)
{
    static const char *const folders[] = {"/model/", "/out/"};
    char *value = word[0] == '-' && strchr(word, '=') ? strchr(word, '=') + 1 : word;
    for (size_t k = 0; k < sizeof folders / sizeof *folders; k++) {
        const size_t length = strlen(folders[k]);
        if (strncmp(value, folders[k], length) == 0)
            memmove(value, value + length, strlen(value + length) + 1);
    }
    return word;
}

static int complain_command(const char *word)
{
    char list[512] = "";
    for (const cli_command *c = cli_commands; c->name; c++)
        if (c->bit & taken) {
            const size_t used = strlen(list);
            (void)snprintf(list + used, sizeof list - used, "%s%s", used ? ", " : "", c->name);
        }
    (void)cli_complain("the workbench does not run '%s'; it runs %s", word, list);
    return 0;
}

int cli_confined_begin(int count, char **words)
{
    char *end = NULL;
    const long given = count > 3 ? strtol(words[2], &end, 10) : -1;
    if (given < 0 || *end || given > count - 4) {
        (void)cli_complain("'confined' is for the workbench: it needs two folders, names and a command");
        return 0;
    }
    const int first = 3 + (int)given;
    folder = words[0];
    scratch = words[1];
    names = words + 3;
    name_count = (int)given;
    const cli_command *command = cli_commands;
    while (command->name && strcmp(command->name, words[first]) != 0)
        command++;
    if (!(command->name && command->bit & taken) && strcmp(words[first], "--version") != 0)
        return complain_command(words[first]);
    for (int k = first + 1; k < count; k++)
        words[k] = without_folder(words[k]);
    cli_terminal_note_progress(in_scratch("progress", -1));
    return first;
}

bool cli_confined_takes(unsigned command, cli_settings *settings)
{
    static char kept[CLI_LIST_SIZE];
    if (!scratch)
        return true;
    if (settings->from)
        return cli_complain("the workbench reads no result folders: --from is for the command line");
    return cli_written_into(command, settings, in_scratch("out", -1), kept);
}

/* The whole text of a file; NULL: it cannot be read. The caller frees it. */
static char *read_text(const char *path)
{
    enum { LEAST = 1 << 16 };
    FILE *file = fopen(path, "rb");
    size_t length = 0, room = LEAST;
    char *text = file ? malloc(room) : NULL;
    while (text) {
        length += fread(text + length, 1, room - 1 - length, file);
        if (length < room - 1)
            break;
        char *more = realloc(text, room *= 2);
        if (!more)
            free(text);
        text = more;
    }
    if (text)
        text[length] = '\0';
    if (file)
        fclose(file);
    return text;
}

kempe_status cli_confine(kempe_context *context)
{
    kempe_status status = scratch ? kempe_context_set_folder(context, folder) : KEMPE_OK;
    for (int k = 0; scratch && status == KEMPE_OK && k < name_count; k++) {
        char *text = read_text(in_scratch("text", k));
        status = text ? kempe_context_set_text(context, names[k], text) : KEMPE_E_MEMORY;
        free(text);
    }
    return status;
}
