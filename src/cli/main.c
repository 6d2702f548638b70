/* SPDX-License-Identifier: BSD-3-Clause */
/* The command `kempe`: help and the choice of a command. It includes only the public header. */
#include "command.h"
#include "completion.h"
#include "confined.h"
#include "own_process.h"
#include "platform/platform.h"
#include "terminal.h"

#include <kempe/cache.h>
#include <stdlib.h>
#include <string.h>

static void print_help(FILE *out)
{
    fputs(
        "kempe " KEMPE_VERSION
        ": simulation of mechanisms with closed kinematic loops\n\nusage: kempe COMMAND FILE [options]\n\ncommands:\n",
        out);
    for (const cli_command *c = cli_commands; c->name; c++)
        fprintf(out, "  %-16s%s\n", c->name, c->summary);
    fputs("\n'kempe help COMMAND' prints the options and examples of a command, 'kempe --version' the version.\n"
          "FILE is a model in YAML, .yaml (docs/model/README.md), URDF, .urdf (docs/urdf.md), MuJoCo's format,\n"
          ".xml or .mjcf (docs/mjcf.md), SDFormat, .sdf (docs/sdf.md), or of ROBOTRAN, .mbs (docs/robotran.md).\n",
          out);
    /* Pages and examples of an installed command are in a folder relative to it, so that its prefix may be moved. In a
     * build folder there is none: their names are relative to the sources. */
    char *path = cli_from_command(CLI_TO_PAGES "/docs/.."), folder[KMP_PATH_MOST];
    if (path && kmp_path_real(path, folder))
        fprintf(out, "Pages and examples are in %s.\n", folder);
    free(path);
    char *cache = kempe_cache_folder();
    if (cache)
        fprintf(out, "Derived equations are kept in %s.\n", cache);
    kempe_text_free(cache);
    fputs("\nexamples:\n  "
          "kempe new four_bar\n  "
          "kempe check examples/andrews/andrews.yaml\n  kempe compare examples/andrews/andrews.yaml --reference "
          "examples/andrews/reference.csv\n\nexit codes: 0 complete, 1 failed or stopped early, 2 error in the input, "
          "3 wrong usage,\n            4 internal error of Kempe, 5 complete but not trustworthy\n",
          out);
}

static int print_command_help(const cli_command *c)
{
    printf("kempe %s: %s\n\nusage: kempe %s %s\n\nexamples:\n%s", c->name, c->summary, c->name,
           c->usage ? c->usage : "FILE [options]", c->examples);
    cli_options_print(c->bit, stdout);
    return CLI_DONE;
}

static int run_command(const cli_command *c, int count, char **words)
{
    static cli_settings settings; /* large: the stack may be small */
    if (!cli_options_read(c->bit, c->name, count, words, &settings))
        return cli_refuse(cli_is_confined() ? NULL : cli_json_word(count, words));
    if (settings.help)
        return print_command_help(c);
    if (!cli_confined_takes(c->bit, &settings))
        return CLI_USAGE;
    if (!cli_written_apart(c->bit, &settings))
        return CLI_USAGE; /* without a JSON, which might be what is written over */
    if (!c->study && !c->run) {
        cli_lacks_wing(c->wing);
        return cli_refuse(settings.json);
    }
    const char *lacking = cli_lacking(c->bit, &settings);
    if (lacking) {
        cli_complain("%s", lacking);
        return cli_refuse(settings.json);
    }
    cli_default(c->bit, &settings);
    return cli_run(c, &settings);
}

static int complain_unknown(const char *word)
{
    const char *names[32] = {"--help", "--version"}; /* more than there are commands */
    for (int k = 0; cli_commands[k].name; k++)
        names[k + 2] = cli_commands[k].name;
    const char *near = cli_nearest(word, names);
    fprintf(stderr, "kempe: unknown %s '%s'", word[0] == '-' ? "option" : "command", word);
    if (near)
        fprintf(stderr, ", did you mean '%s'?\n", near);
    else
        fputs("; 'kempe --help' lists the commands\n", stderr);
    return CLI_USAGE;
}

static int choose(int argc, char **argv)
{
    if (argc < 2) {
        print_help(stderr);
        return CLI_USAGE;
    }
    const bool helps = strcmp(argv[1], "help") == 0;
    if (strcmp(argv[1], "--help") == 0 || strcmp(argv[1], "-h") == 0 || (helps && argc == 2)) {
        print_help(stdout);
        return CLI_DONE;
    }
    if (strcmp(argv[1], "complete") == 0) { /* for shells: not among the commands of the help */
        cli_print_candidates(argc - 2, argv + 2);
        return CLI_DONE;
    }
    if (strcmp(argv[1], "confined") == 0) { /* for the workbench: nor is this one */
        const int taken = cli_confined_begin(argc - 2, argv + 2);
        if (taken == 0)
            return CLI_USAGE;
        argc -= taken + 1;
        argv += taken + 1;
    }
    if (strcmp(argv[1], "--version") == 0) {
        printf("kempe %s\n", kempe_version());
        return CLI_DONE;
    }
    if (helps && argc > 3)
        return complain_unknown(argv[3]);
    for (const cli_command *c = cli_commands; c->name; c++)
        if (strcmp(argv[1 + helps], c->name) == 0)
            return helps ? print_command_help(c) : run_command(c, argc - 2, argv + 2);
    return complain_unknown(argv[1 + helps]);
}

int main(int argc, char **argv)
{
    kmp_command_begin(&argc, &argv);
    cli_own_process();
    cli_terminal_begin(false, false);
    int code = choose(argc, argv);
    if ((fflush(stdout) != 0 || ferror(stdout)) && code == CLI_DONE) {
        fputs("kempe: the result could not be written to standard output\n", stderr);
        return CLI_FAILED;
    }
    return code;
}
