/* SPDX-License-Identifier: BSD-3-Clause */
/* Hides the differences between SUNDIALS 6 and 7: the communicator's type, how a solver is kept from printing, codes of
 * linear solvers, names of ARKODE's functions, the control of its steps. Kempe turns return flags into sentences
 * itself. For the adapters of this folder and of integrators/sundials. */
#pragma once

#include <nvector/nvector_serial.h>
#include <stdint.h>
#include <sundials/sundials_config.h>
#include <sundials/sundials_context.h>
#include <sundials/sundials_types.h>

_Static_assert(sizeof(sunrealtype) == sizeof(double), "SUNDIALS must be built with double precision");
_Static_assert(sizeof(sunindextype) == sizeof(int64_t), "SUNDIALS must be built with indices of 64 bits");

#if SUNDIALS_VERSION_MAJOR >= 7

#include <arkode/arkode.h>
#include <sunadaptcontroller/sunadaptcontroller_soderlind.h>

/* Return codes of Kempe's linear solvers on failure. */
#define KMP_SUN_NO_MEMORY      SUN_ERR_MEM_FAIL
#define KMP_SUN_PACKAGE_FAILED SUN_ERR_EXT_FAIL
#define KMP_SUN_ARK(name)      ARKode##name

static inline SUNContext kmp_sun_context(void)
{
    SUNContext c = NULL;
    if (SUNContext_Create(SUN_COMM_NULL, &c))
        return NULL;
    SUNContext_ClearErrHandlers(c);
    return c;
}

#define KMP_SUN_QUIET(set_handler, memory) ((void)(memory))

/* The control of ARKODE's steps that version 6 has by default, in place of the control of 7.5, whose errors are larger
 * at the same tolerance. The controller belongs to the caller. */
static inline int kmp_sun_control_steps(void *ark, SUNContext context, void **controller)
{
    SUNAdaptController pid = SUNAdaptController_PID(context);
    int bad = pid ? SUNAdaptController_SetErrorBias(pid, 1.5) : SUN_ERR_MEM_FAIL;
    *controller = pid;
    bad = bad ? bad : ARKodeSetAdaptController(ark, pid);
    bad = bad ? bad : ARKodeSetSafetyFactor(ark, 0.96);
    bad = bad ? bad : ARKodeSetFixedStepBounds(ark, 1, 1.5);
    return bad ? bad : ARKodeSetAdaptivityAdjustment(ark, -1);
}

static inline void kmp_sun_controller_free(void *controller)
{
    if (controller)
        (void)SUNAdaptController_Destroy(controller);
}

#else

#define KMP_SUN_NO_MEMORY      SUNLS_MEM_FAIL
#define KMP_SUN_PACKAGE_FAILED SUNLS_PACKAGE_FAIL_UNREC
#define KMP_SUN_ARK(name)      ARKStep##name

static inline SUNContext kmp_sun_context(void)
{
    SUNContext c = NULL;
    return SUNContext_Create(NULL, &c) ? NULL : c;
}

static inline void kmp_sun_say_nothing(int code, const char *module, const char *function, char *text, void *data)
{
    (void)code;
    (void)module;
    (void)function;
    (void)text;
    (void)data;
}

#define KMP_SUN_QUIET(set_handler, memory) ((void)set_handler((memory), kmp_sun_say_nothing, NULL))

static inline int kmp_sun_control_steps(void *ark, SUNContext context, void **controller)
{
    (void)ark;
    (void)context;
    *controller = NULL;
    return 0;
}

static inline void kmp_sun_controller_free(void *controller)
{
    (void)controller;
}

#endif

/** The array of a serial vector. */
static inline double *kmp_sun_data(N_Vector v)
{
    return N_VGetArrayPointer(v);
}
