/* SPDX-License-Identifier: BSD-3-Clause */
/* The terminal of the command in WebAssembly: javascript/kempe.mjs, which takes sentences as they come on stderr, and
 * progress as numbers. It interrupts a run as a person would: the result so far is kept. */
#include "cli/terminal.h"

#include <emscripten.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>

/* Tells the page; true if it asks to stop. */
EM_JS(int, report_progress, (double done, double total, const char *unit, double left),
      { return Module["kempeProgress"] ? Module["kempeProgress"](done, total, UTF8ToString(unit), left) : 0; })

static bool is_quiet;

void cli_terminal_begin(bool quiet, bool same_screen)
{
    (void)same_screen;
    is_quiet = quiet;
}

void cli_terminal_shows(const char *text)
{
    (void)text;
}

void cli_terminal_log(void *user, kempe_level level, const char *line)
{
    (void)user;
    if (level == KEMPE_LOG_WARNING)
        fprintf(stderr, "kempe: warning: %s\n", line);
}

bool cli_terminal_shows_progress(double *interval)
{
    *interval = 0.1;
    return !is_quiet;
}

void cli_terminal_progress(void *user, const kempe_progress *p)
{
    (void)user;
    if (report_progress(p->done, p->total, p->unit, p->left_s))
        (void)raise(SIGINT);
}

void cli_terminal_note_progress(const char *path)
{
    (void)path;
}

void cli_terminal_written(const char *path)
{
    (void)path;
}

void cli_terminal_error(const char *prefix, const char *message)
{
    while (*message) {
        int length = (int)strcspn(message, "\n");
        fprintf(stderr, "%s%.*s\n", prefix, length, message);
        message += length + (message[length] == '\n');
    }
}

void cli_terminal_clear(void)
{
}
