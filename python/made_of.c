/* SPDX-License-Identifier: BSD-3-Clause */
/* The parts of this build of the library, for kempe.about(). */
#include "backend/encoders.h"
#include "ensemble/fit/nonlinear_squares.h"
#include "ensemble/optimize/constrained_minimum.h"
#include "helpers.h"
#include <klu.h>
#include <sundials/sundials_config.h>

#define TEXT_OF(number) #number
#define TEXT(number)    TEXT_OF(number)

const char *python_sundials(void)
{
    return SUNDIALS_VERSION;
}

const char *python_klu(void)
{
    return TEXT(KLU_MAIN_VERSION) "." TEXT(KLU_SUB_VERSION) "." TEXT(KLU_SUBSUB_VERSION);
}

const char *python_backend(void)
{
    return kmp_code_runs(KMP_CODE_EIGHT) ? "machine code, lanes of eight"
           : kmp_code_form_of(4)         ? "machine code, lanes of four"
                                         : "tape";
}

const char *python_integrators(void)
{
#define KMP_SOLVER(name) #name " "
    return
#include "integrators/steppers/integrators.def"
        ;
#undef KMP_SOLVER
}

const char *python_linear_solvers(void)
{
#define KMP_LINEAR(name) #name " "
    return
#include "integrators/sundials/linear.def"
        ;
#undef KMP_LINEAR
}

const char *python_searches(void)
{
    bool squares = kmp_squares_available, minimum = kmp_minimum_available;
    return squares && minimum ? "cminpack nlopt" : squares ? "cminpack" : minimum ? "nlopt" : "";
}
