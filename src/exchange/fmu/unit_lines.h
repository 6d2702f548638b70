/* SPDX-License-Identifier: BSD-3-Clause */
/* Files of units that the build put into the library, line by line; NULL ends them. */
#pragma once

extern const char *const kmp_kempe_fmu_h[], *const kmp_kempe_fmu_c[];
extern const char *const kmp_kempe_fmi_h[];
extern const char *const kmp_kempe_fmi2_h[], *const kmp_kempe_fmi2_c[];
extern const char *const kmp_kempe_fmi3_h[], *const kmp_kempe_fmi3_c[];
extern const char *const kmp_license_lines[];
