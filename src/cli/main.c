/* SPDX-License-Identifier: BSD-3-Clause */
/* The command `kempe`: a table of commands, help and the choice of one. It sees the public header alone. */
#include "commands.h"

#include <string.h>

typedef struct command {
    unsigned bit;
    const char *name, *usage, *summary, *examples;
} command;

static const command commands[] = {
    {CLI_CHECK, "check", "FILE [options]", "mobility, redundant closures, the independent coordinates and why",
     "  kempe check examples/andrews/andrews.yaml\n"},
    {CLI_ASSEMBLE, "assemble", "FILE [options]", "close the loops from the model's guess",
     "  kempe assemble examples/four_bar/four_bar.yaml --json start.json\n"
     "  kempe assemble examples/four_bar/four_bar.yaml --branches\n"},
    {CLI_SIMULATE, "simulate", "FILE [options]", "run one road and judge the result",
     "  kempe simulate examples/andrews/andrews.yaml -o andrews.csv\n"
     "  kempe simulate examples/slider_crank/slider_crank.yaml --rtol 1e-8 --t-end 2 --every 0.01\n"
     "  kempe simulate examples/andrews/andrews.yaml --road dae --json -\n"},
    {CLI_ENSEMBLE, "ensemble", "FILE --values CSV | --sample RANGES [options]",
     "many instances with different parameters, side by side",
     "  kempe ensemble examples/four_bar/four_bar.yaml --values bars.csv -o ends.csv\n"
     "  kempe ensemble examples/four_bar/four_bar.yaml --sample crank=0.28:0.32,base=0.85:0.95 --instances 10000\n"},
    {CLI_COMPARE, "compare", "FILE [options]", "roads and tolerances side by side against a reference",
     "  kempe compare examples/andrews/andrews.yaml --reference examples/andrews/reference.csv\n"
     "  kempe compare examples/four_bar/four_bar.yaml --rtol 1e-6,1e-9 --roads reduced,dae --csv table.csv\n"
     "  kempe compare examples/andrews/andrews.yaml --report andrews.html\n"},
    {CLI_SHOW, "show", "FILE --model | --equations | --program | --stats", "print what Kempe made of the model",
     "  kempe show examples/andrews/andrews.yaml --stats\n"
     "  kempe show examples/four_bar/four_bar.yaml --equations\n"
     "  kempe show examples/four_bar/four_bar.yaml --equations --stats\n"},
    {CLI_GENERATE, "generate", "FILE --lang NAME | --count [options]",
     "sets of equations in other languages, and what they cost",
     "  kempe generate examples/andrews/andrews.yaml --lang c -o andrews\n"
     "  kempe generate examples/andrews/andrews.yaml --count\n"
     "  kempe generate examples/andrews/andrews.yaml --count --sets M_C,invdyn --keep-parameters --body-inputs\n"},
};

enum { COMMAND_COUNT = sizeof commands / sizeof *commands };

static void print_help(FILE *out)
{
    fputs("kempe " KEMPE_VERSION ": mechanisms with closed loops, solved along several roads on the same equations\n\n"
          "usage: kempe COMMAND FILE [options]\n\ncommands:\n",
          out);
    for (int k = 0; k < COMMAND_COUNT; k++)
        fprintf(out, "  %-10s%s\n", commands[k].name, commands[k].summary);
    fputs("\n'kempe COMMAND --help' gives a command's options and examples, 'kempe --version' the version.\n"
          "FILE is a Kempe model in YAML (docs/model_format.md) or one of ROBOTRAN, .mbs (docs/robotran.md).\n\n"
          "examples:\n"
          "  kempe check examples/andrews/andrews.yaml\n"
          "  kempe compare examples/andrews/andrews.yaml --reference examples/andrews/reference.csv\n\n"
          "exit codes: 0 done, 1 the computation failed, 2 the input is wrong, 3 usage, 4 a defect of Kempe\n",
          out);
}

static void print_command_help(const command *c)
{
    printf("kempe %s: %s\n\nusage: kempe %s %s\n\noptions:\n", c->name, c->summary, c->name, c->usage);
    cli_options_print(c->bit, stdout);
    printf("\nexamples:\n%s", c->examples);
}

static int complain_unknown(const char *word)
{
    const char *names[COMMAND_COUNT + 3] = {"--help", "--version"};
    for (int k = 0; k < COMMAND_COUNT; k++)
        names[k + 2] = commands[k].name;
    const char *near = cli_nearest(word, names);
    fprintf(stderr, "kempe: unknown %s '%s'", word[0] == '-' ? "option" : "command", word);
    if (near)
        fprintf(stderr, ", did you mean '%s'?\n", near);
    else
        fputs("; 'kempe --help' lists the commands\n", stderr);
    return CLI_USAGE;
}

/* `show` prints one thing at a time; equations and stats together are the passes. */
static bool one_view(const cli_settings *s)
{
    if (s->show_equations && s->show_stats && !s->show_model && !s->show_program)
        return true;
    if (s->show_model + s->show_equations + s->show_program + s->show_stats == 1)
        return true;
    fputs("kempe: show needs one of --model, --equations, --program, --stats\n", stderr);
    return false;
}

static bool says_what_to_generate(const cli_settings *s)
{
    if (!s->count && !s->generation.language)
        fputs("kempe: generate needs --lang NAME, or --count\n", stderr);
    return s->count || s->generation.language;
}

static bool says_which_instances(const cli_settings *s)
{
    if (!s->values == !s->sample)
        fputs("kempe: ensemble needs one of --values CSV, --sample NAME=A:B,..\n", stderr);
    return !s->values != !s->sample;
}

static int run_command(const command *c, int count, char **words)
{
    cli_settings settings;
    if (!cli_options_read(c->bit, c->name, count, words, &settings))
        return CLI_USAGE;
    if (settings.help) {
        print_command_help(c);
        return CLI_DONE;
    }
    if (c->bit == CLI_SHOW && !one_view(&settings))
        return CLI_USAGE;
    if (c->bit == CLI_GENERATE && !says_what_to_generate(&settings))
        return CLI_USAGE;
    if (c->bit == CLI_ENSEMBLE && !says_which_instances(&settings))
        return CLI_USAGE;
    return cli_run(c->bit, &settings);
}

static int choose(int argc, char **argv)
{
    if (argc < 2) {
        print_help(stderr);
        return CLI_USAGE;
    }
    if (strcmp(argv[1], "--help") == 0 || strcmp(argv[1], "-h") == 0) {
        print_help(stdout);
        return CLI_DONE;
    }
    if (strcmp(argv[1], "--version") == 0) {
        puts("kempe " KEMPE_VERSION);
        return CLI_DONE;
    }
    for (int k = 0; k < COMMAND_COUNT; k++)
        if (strcmp(argv[1], commands[k].name) == 0)
            return run_command(&commands[k], argc - 2, argv + 2);
    return complain_unknown(argv[1]);
}

int main(int argc, char **argv)
{
    int code = choose(argc, argv);
    if ((fflush(stdout) != 0 || ferror(stdout)) && code == CLI_DONE) {
        fputs("kempe: the result could not be written to standard output\n", stderr);
        return CLI_FAILED;
    }
    return code;
}
