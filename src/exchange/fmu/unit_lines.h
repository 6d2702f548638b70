/* SPDX-License-Identifier: BSD-3-Clause */
/* Files of units that the build put into the library, line by line; NULL ends them. */
#pragma once

extern const char *const kmp_kempe_fmu_h[], *const kmp_kempe_fmu_c[];
extern const char *const kmp_kempe_fmi_h[];
extern const char *const kmp_kempe_fmi2_c[], *const kmp_kempe_fmi3_c[];
extern const char *const kmp_fmi2Functions_h[], *const kmp_fmi2FunctionTypes_h[], *const kmp_fmi2TypesPlatform_h[];
extern const char *const kmp_fmi3Functions_h[], *const kmp_fmi3FunctionTypes_h[], *const kmp_fmi3PlatformTypes_h[];
extern const char *const kmp_license_lines[];
