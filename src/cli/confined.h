/* SPDX-License-Identifier: BSD-3-Clause */
/* A command that the workbench runs for its page: it reads only files in a folder, and writes only into another one.
 * The words before the command's are not for users:
 *
 *     kempe confined FOLDER SCRATCH COUNT NAME.. COMMAND FILE [options]
 *
 * FOLDER is read. SCRATCH has the texts `text0`, `text1`.. that are read in place of the COUNT files of these names,
 * and a folder `out` for all that is written; progress goes to its file `progress`. In words, `/model/` and `/out/`
 * begin the names of files in these two folders, as in javascript/kempe.mjs. */
#pragma once

#include "options.h"

/** Takes the words behind `confined`; returns their number before the command's name, 0 after an error message. */
int cli_confined_begin(int count, char **words);

bool cli_is_confined(void);

/** Judges a command that is confined, and moves the files that it writes. False after an error message. */
bool cli_confined_takes(unsigned command, cli_settings *settings);

/** Gives a confined command's context its texts, and lets it read only in the folder. */
kempe_status cli_confine(kempe_context *context);
