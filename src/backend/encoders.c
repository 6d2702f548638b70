/* SPDX-License-Identifier: BSD-3-Clause */
#include "backend/encoders.h"
#include "backend/arm64/arm64.h"
#include "backend/x86/x86.h"

const kmp_encoder *kmp_encoder_here(void)
{
    return kmp_encoder_arm64.runs(KMP_CODE_ONE) ? &kmp_encoder_arm64 : &kmp_encoder_x86;
}

bool kmp_code_runs(kmp_code_form form)
{
    return kmp_encoder_here()->runs(form);
}

kmp_code_form kmp_code_form_of(int lanes)
{
    for (const kmp_code_form *form = kmp_encoder_here()->forms; *form; form++)
        if (kmp_code_lanes(*form) == lanes && kmp_code_runs(*form))
            return *form;
    return 0;
}
