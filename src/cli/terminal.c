/* SPDX-License-Identifier: BSD-3-Clause */
#include "terminal.h"
#include "platform/platform.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define RED    "\033[31m"
#define YELLOW "\033[33m"
#define PLAIN  "\033[0m"
#define ERASE  "\r\033[K"

static bool is_terminal, has_colour, is_quiet, progress_shown;
static FILE *noted; /* lines of progress for another program; NULL: none */

/* Sentences that wait for the result, in their order. */
typedef struct sentence {
    const char *colour, *prefix;
    char *words;
    struct sentence *next;
} sentence;

static bool waits;
static sentence *first, **end = &first;

void cli_terminal_begin(bool quiet, bool same_screen)
{
    const char *none = getenv("NO_COLOR"), *term = getenv("TERM");
    is_terminal = kmp_is_terminal(stderr);
    is_quiet = quiet;
    waits = same_screen && is_terminal && kmp_is_terminal(stdout);
    has_colour = is_terminal && !(none && *none) && term && strcmp(term, "dumb") != 0;
}

void cli_terminal_clear(void)
{
    if (progress_shown)
        fputs(ERASE, stderr);
    progress_shown = false;
}

static void show_progress(const char *line)
{
    const int columns = kmp_terminal_width(), width = columns > 1 ? columns - 1 : 79;
    fprintf(stderr, ERASE "%.*s", width, line);
    fflush(stderr);
    progress_shown = true;
}

static void print_sentence(const char *colour, const char *prefix, int length, const char *words)
{
    cli_terminal_clear();
    fprintf(stderr, "%s%s%s%.*s\n", has_colour ? colour : "", prefix, has_colour ? PLAIN : "", length, words);
}

/* Prints a sentence, now or after the result. */
static void write_line(const char *colour, const char *prefix, int length, const char *words)
{
    sentence *s = waits ? malloc(sizeof *s) : NULL;
    char *copy = s ? calloc((size_t)length + 1, 1) : NULL;
    if (!copy) {
        free(s);
        print_sentence(colour, prefix, length, words);
        return;
    }
    memcpy(copy, words, (size_t)length);
    *s = (sentence){colour, prefix, copy, NULL};
    *end = s;
    end = &s->next;
}

/* True if a text has the words, wherever its lines break. */
static bool has_words(const char *text, const char *words)
{
    for (; *text; text++)
        for (const char *a = text, *b = words; *a == *b; a++, b++) {
            a += strspn(a + 1, " \n");
            b += strspn(b + 1, " \n");
            if (!b[1])
                return true;
        }
    return false;
}

void cli_terminal_shows(const char *text)
{
    for (sentence *s = first, *next; s; s = next) {
        next = s->next;
        if (!has_words(text, s->words))
            print_sentence(s->colour, s->prefix, (int)strlen(s->words), s->words);
        free(s->words);
        free(s);
    }
    first = NULL;
    end = &first;
}

void cli_terminal_log(void *user, kempe_level level, const char *line)
{
    (void)user;
    if (level == KEMPE_LOG_WARNING) {
        write_line(YELLOW, "kempe: warning: ", (int)strlen(line), line);
    } else if (is_terminal && !is_quiet && level == KEMPE_LOG_PROGRESS) {
        show_progress(line);
    } else if (is_terminal && !is_quiet) {
        cli_terminal_clear();
        fprintf(stderr, "%s\n", line);
    }
}

bool cli_terminal_shows_progress(double *interval)
{
    *interval = noted ? 0.1 : 1;
    return noted || (is_terminal && !is_quiet);
}

void cli_terminal_note_progress(const char *path)
{
    noted = fopen(path, "wb");
}

/* The rate is the mean of the whole run so far: simulated seconds, or instances, in a second of wall-clock time. */
void cli_terminal_progress(void *user, const kempe_progress *p)
{
    char line[120], rate[40] = "", left[40] = "";
    bool is_time = strcmp(p->unit, "s") == 0;
    (void)user;
    if (noted) {
        fprintf(noted, "{\"done\": %.9g, \"total\": %.9g, \"unit\": \"%s\", \"leftSeconds\": ", p->done, p->total,
                p->unit);
        fprintf(noted, p->left_s < 0 ? "null}\n" : "%.3g}\n", p->left_s);
        (void)fflush(noted);
        return;
    }
    if (p->left_s > 0)
        (void)snprintf(rate, sizeof rate, ", %.3g %s per second", (p->total - p->done) / p->left_s, p->unit);
    if (p->left_s >= 0)
        (void)snprintf(left, sizeof left, ", %.3g s left", p->left_s);
    (void)snprintf(line, sizeof line, "%s%.6g of %.6g %s (%.0f %%)%s%s", is_time ? "t = " : "", p->done, p->total,
                   p->unit, 100 * p->done / p->total, rate, left);
    show_progress(line);
}

void cli_terminal_written(const char *path)
{
    cli_terminal_clear();
    if (is_terminal && !is_quiet)
        fprintf(stderr, "written: %s\n", path);
}

void cli_terminal_error(const char *prefix, const char *message)
{
    while (*message) {
        int length = (int)strcspn(message, "\n");
        write_line(RED, prefix, length, message);
        message += length + (message[length] == '\n');
    }
}
