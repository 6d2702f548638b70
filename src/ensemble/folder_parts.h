/* SPDX-License-Identifier: BSD-3-Clause */
/* The parts of a result folder: read, checked, and put together. */
#pragma once

#include <kempe/ensemble.h>

/** KEMPE_E_INPUT: the results belong to another model. */
kempe_status kmp_folder_check_model(const kempe_folder *folder, const kempe_model *model);

/** All rows as one table "instances", checked as kempe_folder_write does. */
kempe_status kmp_folder_table(kempe_folder *folder, kempe_table **table);

/** The verdict on the instances that a check has counted. */
kempe_status kmp_folder_judge(const kempe_folder *folder, kempe_status status);
