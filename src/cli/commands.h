/* SPDX-License-Identifier: BSD-3-Clause */
/* What the commands do once their options are read. */
#ifndef KEMPE_CLI_COMMANDS_H
#define KEMPE_CLI_COMMANDS_H

#include "options.h"

/* Exit codes: a promise to scripts. */
enum {
    CLI_DONE = 0,
    CLI_FAILED = 1, /* the computation could not be done as asked */
    CLI_INPUT = 2,  /* the model or reference is wrong */
    CLI_USAGE = 3,
    CLI_BUG = 4 /* a defect of Kempe, or no memory */
};

/** Runs one command (a bit of options.h) with its own context and returns the exit code. */
int cli_run(unsigned command, const cli_settings *settings);

#endif
