/* SPDX-License-Identifier: BSD-3-Clause */
/* Lines on stderr: errors, warnings, the log of runs, and one progress line that is written over. Progress and log
 * appear on a terminal only. Colour appears there unless the environment has NO_COLOR (https://no-color.org) or TERM is
 * "dumb". */
#pragma once

#include <kempe/kempe.h>
#include <stdbool.h>

/** Quiet: neither progress nor log. `same_screen`: warnings and errors wait for the result's text where both appear on
 * one terminal. */
void cli_terminal_begin(bool quiet, bool same_screen);

/** Prints the warnings and errors that wait, except the ones in a text that appears next. */
void cli_terminal_shows(const char *text);

/** The log function of a context; `user` is unused. */
void cli_terminal_log(void *user, kempe_level level, const char *line);

/** The function of a context for progress, if it is shown, and the seconds between two calls; `user` is unused. */
bool cli_terminal_shows_progress(double *interval);
void cli_terminal_progress(void *user, const kempe_progress *progress);

/** Progress goes to a file instead, a line of JSON each time. */
void cli_terminal_note_progress(const char *path);

/** Notes that a file was written. */
void cli_terminal_written(const char *path);

/** Prints an error, each of its lines after `prefix`. */
void cli_terminal_error(const char *prefix, const char *message);

/** Removes the progress line before other text. */
void cli_terminal_clear(void);
