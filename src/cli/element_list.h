/* SPDX-License-Identifier: BSD-3-Clause */
/* The library of machine elements in the command. */
#pragma once

#include "command.h"

/** True for `kempe:NAME.yaml`. */
bool cli_is_element(const char *file);

/** `kempe show kempe:NAME.yaml`: the text of an element. */
kempe_status cli_show_element(const cli_job *j);

/** `kempe new --elements`: name, ports and subject of each. */
kempe_status cli_list_elements(const cli_job *j);
