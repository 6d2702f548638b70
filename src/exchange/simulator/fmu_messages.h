/* SPDX-License-Identifier: BSD-3-Clause */
/* Sentences to the importer. A part of kempe_fmu.c. */
#pragma once

#include "exchange/simulator/kempe_fmu.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

const char *const kempe_fmu_categories[KEMPE_FMU_LOG_CATEGORIES + 1] = {
    "logEvents", "logStatusWarning", "logStatusDiscard", "logStatusError", "logSteps", "logAll"};

kempe_fmu_status kempe_fmu_say(kempe_fmu *fmu, kempe_fmu_status status, int category, const char *format, ...)
{
    char sentence[KEMPE_FMU_SENTENCE];
    va_list arguments;
    if (!fmu->log || (status == KEMPE_FMU_OK && !(fmu->logged & 1u << category)))
        return status;
    va_start(arguments, format);
    (void)vsnprintf(sentence, sizeof sentence, format, arguments);
    va_end(arguments);
    fmu->log(fmu, status, kempe_fmu_categories[category], sentence);
    return status;
}

#define FAIL(...)    kempe_fmu_say(fmu, KEMPE_FMU_ERROR, KEMPE_FMU_LOG_ERROR, __VA_ARGS__)
#define DISCARD(...) kempe_fmu_say(fmu, KEMPE_FMU_DISCARD, KEMPE_FMU_LOG_DISCARD, __VA_ARGS__)

static const char *mode_name(int mode)
{
    return mode == KEMPE_FMU_INSTANTIATED     ? "Instantiated"
           : mode == KEMPE_FMU_INITIALIZATION ? "Initialization Mode"
           : mode == KEMPE_FMU_EVENT          ? "Event Mode"
           : mode == KEMPE_FMU_CONTINUOUS     ? "Continuous-Time Mode"
           : mode == KEMPE_FMU_STEP           ? "Step Mode"
           : mode == KEMPE_FMU_INTERMEDIATE   ? "Intermediate Update Mode"
                                              : "Terminated";
}

int kempe_fmu_allows(kempe_fmu *fmu, int modes, const char *function)
{
    if (!fmu)
        return 0;
    if (fmu->now.mode & modes)
        return 1;
    (void)FAIL("%s is not allowed in the state '%s' of the instance: see the state machine of the FMI standard.",
               function, mode_name(fmu->now.mode));
    return 0;
}

kempe_fmu_status kempe_fmu_choose_categories(kempe_fmu *fmu, int on, size_t count, const char *const *names)
{
    const unsigned all = (1u << KEMPE_FMU_LOG_CATEGORIES) - 1u;
    unsigned chosen = count ? 0 : all;
    for (size_t i = 0; i < count; i++) {
        int c = 0;
        while (c <= KEMPE_FMU_LOG_CATEGORIES && (!names || !names[i] || strcmp(kempe_fmu_categories[c], names[i]) != 0))
            c++;
        if (c > KEMPE_FMU_LOG_CATEGORIES)
            return FAIL("The category '%s' of messages does not exist: modelDescription.xml lists the categories.",
                        names && names[i] ? names[i] : "");
        chosen |= c == KEMPE_FMU_LOG_CATEGORIES ? all : 1u << c;
    }
    fmu->logged = on ? fmu->logged | chosen : fmu->logged & ~chosen;
    return KEMPE_FMU_OK;
}
