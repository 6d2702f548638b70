/* SPDX-License-Identifier: BSD-3-Clause */
/* Completion of command lines for bash, zsh and fish: `kempe complete WORD..` prints what its last word may become. */
#pragma once

/** Prints the candidates for the last of the words behind `kempe`, one a line, folders with a slash. */
void cli_print_candidates(int count, char **words);
