/* SPDX-License-Identifier: BSD-3-Clause */
/* The shells' files in packaging call this for every kind of word: commands, options, their values, files. Options are
 * taken from the table in options.c; the words that an option knows are here. */
#include "completion.h"
#include "platform/platform.h"

#include "command.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define MODELS      ".yaml, .urdf, .xml, .mjcf, .sdf, .mbs"
#define RUNS        "dop853 dopri5 radau erk radau5 radau9"
#define INTEGRATORS RUNS " adams bdf dirk ida"
#define FORMS       "integrated newton stabilized1 ggl index2 index1 index3"

/* Words that an option knows; the first row of a command counts. */
static const struct {
    unsigned commands;
    const char *option, *words;
} known[] = {
    {CLI_ALL, "algorithm", "auto composite plain ner articulated"},
    {CLI_ALL, "angle-unit", "rad deg"},
    {CLI_ALL, "as", "urdf+ sdf mjcf yaml"},
    {CLI_ALL, "at", "equilibrium start"},
    {CLI_ALL, "backend", "native tape"},
    {CLI_ALL, "base", "fixed free"},
    {CLI_ALL, "bodies", "rigid none first full"},
    {CLI_ALL, "change-points", "cross ignore"},
    {CLI_ALL, "design", "random latin sobol saltelli grid"},
    {CLI_ALL, "elastic", "held static"},
    {CLI_ALL, "fmi", "2 3"},
    {CLI_GENERATE, "form", "legible compact"},
    {CLI_ALL, "form", FORMS},
    {CLI_ALL, "forms", FORMS},
    {CLI_ALL, "formulation", "reduced projected dae"},
    {CLI_ALL, "formulations", "reduced projected dae"},
    {CLI_ALL, "frame", "clamped chord"},
    {CLI_SENSITIVITY | CLI_FIT | CLI_OPTIMIZE | CLI_CYCLES, "integrator", RUNS},
    {CLI_ALL, "integrator", INTEGRATORS},
    {CLI_ALL, "integrators", INTEGRATORS},
    {CLI_ALL, "kind", "me cs"},
    {CLI_ALL, "lang", "c casadi jax octave python torch"},
    {CLI_ALL, "law", "linear shen polach tanh fastsim fastsim1 half-space"},
    {CLI_ALL, "linear", "auto klu umfpack dense"},
    {CLI_ALL, "loads", "least-norm"},
    {CLI_SENSITIVITY, "method", "forward adjoint"},
    {CLI_ALL, "method", "slopes values"},
    {CLI_ALL, "of", "trajectory equilibrium modes reactions"},
    {CLI_ALL, "pressure", "half-space analyn kik-piotrowski"},
    {CLI_ALL, "scheme", "composite ner"},
    {CLI_ALL, "sets",
     "M_C invdyn h_J jdqd M C qdd h J h_t tangents R R_tangents invdyn_q invdyn_qd R_q friction contact impact "
     "discrete outputs"},
    {CLI_ENSEMBLE | CLI_FIT | CLI_OPTIMIZE, "threads", "auto"},
    {CLI_SYSTEMS, "units", "si mm us"},
};

static const char *words_of(unsigned command, const char *option)
{
    for (size_t k = 0; k < sizeof known / sizeof *known; k++)
        if ((known[k].commands & command) && strcmp(known[k].option, option) == 0)
            return known[k].words;
    return NULL;
}

/* The ones of these words that continue `typed`, behind the text before it; returns their number. */
static int put_words(const char *words, const char *before, int length, const char *typed)
{
    int count = 0;
    for (const char *word = words; *word; word += strspn(word, " ")) {
        const int size = (int)strcspn(word, " ");
        if (strncmp(word, typed, strlen(typed)) == 0) {
            printf("%.*s%.*s\n", length, before, size, word);
            count++;
        }
        word += size;
    }
    return count;
}

static bool has_ending(const char *name, const char *endings)
{
    const char *dot = strrchr(name, '.'), *at = dot && endings ? strstr(endings, dot) : NULL;
    return !endings || (at && (at[strlen(dot)] == ',' || !at[strlen(dot)]));
}

/* Folders, and files with one of the endings (NULL: any), that continue the path. */
static void put_files(const char *before, const char *typed, const char *endings)
{
    const char *name = kmp_path_name(typed), *home = kmp_environment("HOME");
    const bool at_home = strncmp(typed, "~/", 2) == 0 && home;
    char folder[4096], path[8192];
    snprintf(folder, sizeof folder, "%s%.*s",
             at_home        ? home
             : name > typed ? ""
                            : "./",
             name > typed ? (int)(name - typed) - at_home : 0, typed + at_home);
    kmp_folder_names *open = kmp_folder_names_begin(folder);
    for (const char *found; open && (found = kmp_folder_names_next(open));) {
        kmp_path_state of;
        if (strncmp(found, name, strlen(name)) != 0 || (found[0] == '.' && name[0] != '.') ||
            snprintf(path, sizeof path, "%s%s", folder, found) >= (int)sizeof path || !kmp_path_look(path, &of))
            continue;
        if (of.kind == KMP_PATH_FOLDER || has_ending(found, endings))
            printf("%s%.*s%s%s\n", before, (int)(name - typed), typed, found, of.kind == KMP_PATH_FOLDER ? "/" : "");
    }
    kmp_folder_names_end(open);
}

/* The name of a file that is written, with each of its endings. */
static void put_endings(const char *before, const char *typed, const char *endings)
{
    const char *name = kmp_path_name(typed);
    if (!*name || strchr(name, '.'))
        return;
    for (const char *at = endings; *at; at += strspn(at, ", ")) {
        const int length = (int)strcspn(at, ",");
        printf("%s%s%.*s\n", before, typed, length, at);
        at += length;
    }
}

/* The value of an option, behind `before`, which is "--name=" or nothing. False: an option without its value, which it
 * may lack, is before the word. */
static bool put_values(unsigned command, const cli_option_view *o, const char *before, const char *typed)
{
    static const char *const files[] = {"FILE", "CSV", "PATH|-", "FOLDER", "DIR"};
    const char *words = words_of(command, o->name), *comma = strrchr(typed, ',');
    if (words) {
        const char *part = comma && strstr(o->value, ",..") ? comma + 1 : typed;
        char front[1024];
        const int length = snprintf(front, sizeof front, "%s%.*s", before, (int)(part - typed), typed);
        return put_words(words, front, length, part) > 0 || o->value[0] != '[';
    }
    for (size_t k = 0; k < sizeof files / sizeof *files; k++)
        if (strcmp(o->value, files[k]) == 0) {
            const char *endings = k == 1 ? ".csv" : k > 2 ? "." : o->ending;
            put_files(before, typed, endings);
            if (o->ending)
                put_endings(before, typed, o->ending);
        }
    return true;
}

/* The option that a word names; false: none. */
static bool find_option(unsigned command, const char *word, size_t length, cli_option_view *o)
{
    for (int k = 0; cli_option_look(command, k, o); k++)
        if ((length > 2 && strlen(o->name) == length - 2 && strncmp(word + 2, o->name, length - 2) == 0) ||
            (length == 2 && word[1] == o->letter && o->letter))
            return true;
    return false;
}

static void complete_of(const cli_command *c, int count, char **words)
{
    const char *last = words[count - 1], *before = count > 1 ? words[count - 2] : "";
    const size_t length = strcspn(last, "=");
    cli_option_view o;
    if (before[0] == '-' && find_option(c->bit, before, strlen(before), &o) && o.value &&
        put_values(c->bit, &o, "", last))
        return;
    if (last[0] == '-' && last[length] && find_option(c->bit, last, length, &o) && o.value) {
        char front[128];
        snprintf(front, sizeof front, "--%s=", o.name);
        (void)put_values(c->bit, &o, front, last + length + 1);
    } else if (last[0] == '-') {
        for (int k = 0; cli_option_look(c->bit, k, &o); k++)
            if (strncmp(last, "--", strlen(last) < 2 ? strlen(last) : 2) == 0 &&
                (strlen(last) < 2 || strncmp(o.name, last + 2, strlen(last) - 2) == 0))
                printf("--%s\n", o.name);
    } else if (c->bit != CLI_NEW) {
        for (int k = 0; c->bit == CLI_SHOW && last[0] && k < kempe_element_count(); k++)
            if (strncmp(kempe_element_name(k), last, strlen(last)) == 0)
                puts(kempe_element_name(k));
        put_files("", last,
                  c->bit == CLI_GATHER   ? "."
                  : c->bit == CLI_REDUCE ? NULL
                  : c->bit == CLI_FIT    ? MODELS ", .csv, .parquet"
                  : c->opens_pages       ? MODELS ", .html"
                                         : MODELS);
    }
}

void cli_print_candidates(int count, char **words)
{
    const bool helps = count > 1 && strcmp(words[0], "help") == 0;
    const char *last = count > 0 ? words[count - 1] : "";
    if (count <= 1 + helps) {
        for (const cli_command *c = cli_commands; c->name; c++)
            put_words(c->name, "", 0, last);
        put_words(helps ? "" : "help --help --version", "", 0, last);
        return;
    }
    for (const cli_command *c = cli_commands; c->name && !helps; c++)
        if (strcmp(words[0], c->name) == 0)
            complete_of(c, count - 1, words + 1);
}
