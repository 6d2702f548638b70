/* SPDX-License-Identifier: BSD-3-Clause */
/* Files that are installed with the command. */
#pragma once

/** Appends `relative` to the folder of the command, for the caller to free; NULL: the folder is unknown. */
char *cli_from_command(const char *relative);
