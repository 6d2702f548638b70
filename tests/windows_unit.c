/* SPDX-License-Identifier: BSD-3-Clause */
/* A small importer of functional mock-up units, for any platform: tests/windows_units.py compiles it for Linux and
 * Windows.
 *
 *     windows_unit LIBRARY FMI KIND TOKEN RESOURCES END STEPS REFERENCE ..
 *
 * It simulates until END in equal steps, KIND cs by the unit and me by Heun's method, and prints the time and the
 * values of the references behind each step. */
#include "fmi2Functions.h"
#include "fmi3Functions.h"
#include "platform/platform.h"
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

enum { MOST = 256 };

static void *library;
static double end;
static int steps, count;
static unsigned references[MOST];
static double values[MOST], x[MOST], first[MOST], second[MOST], moved[MOST];

/* The function FMI##name of the library, by its type of the standard. */
#define CALL(type, name) ((type *)address(#name))

static void *address(const char *name)
{
    void *found = kmp_library_find(library, name);
    if (!found) {
        printf("no function %s\n", name);
        exit(1);
    }
    return found;
}

static void wanted(unsigned status, const char *what)
{
    if (status != 0) {
        printf("%s: status %u\n", what, status);
        exit(1);
    }
}

static void put_row(double t)
{
    printf("%.17g", t);
    for (int k = 0; k < count; k++)
        printf(" %.17g", values[k]);
    printf("\n");
}

static void say_3(fmi3InstanceEnvironment user, fmi3Status status, fmi3String category, fmi3String message)
{
    (void)user;
    fprintf(stderr, "%d %s: %s\n", (int)status, category, message);
}

static void say_2(fmi2ComponentEnvironment user, fmi2String name, fmi2Status status, fmi2String category,
                  fmi2String message, ...)
{
    (void)user;
    fprintf(stderr, "%s %d %s: %s\n", name, (int)status, category, message);
}

static void read_3(fmi3Instance c, double t)
{
    wanted(CALL(fmi3GetFloat64TYPE, fmi3GetFloat64)(c, references, (size_t)count, values, (size_t)count), "values");
    put_row(t);
}

static fmi3Instance begin_3(const char *token, const char *resources, int exchange)
{
    fmi3Instance c =
        exchange ? CALL(fmi3InstantiateModelExchangeTYPE,
                        fmi3InstantiateModelExchange)("one", token, resources, fmi3False, fmi3False, NULL, say_3)
                 : CALL(fmi3InstantiateCoSimulationTYPE, fmi3InstantiateCoSimulation)(
                       "one", token, resources, fmi3False, fmi3False, fmi3False, fmi3False, NULL, 0, NULL, say_3, NULL);
    if (!c)
        exit(1);
    wanted(CALL(fmi3EnterInitializationModeTYPE, fmi3EnterInitializationMode)(c, fmi3False, 0, 0, fmi3True, end),
           "start");
    wanted(CALL(fmi3ExitInitializationModeTYPE, fmi3ExitInitializationMode)(c), "start");
    return c;
}

static void simulate_3(const char *token, const char *resources)
{
    fmi3Instance c = begin_3(token, resources, 0);
    fmi3Boolean event, ends, early;
    double last;
    read_3(c, 0);
    for (int k = 0; k < steps; k++) {
        const double t = end * k / steps, next = end * (k + 1) / steps;
        wanted(CALL(fmi3DoStepTYPE, fmi3DoStep)(c, t, next - t, fmi3True, &event, &ends, &early, &last), "step");
        read_3(c, next);
    }
    CALL(fmi3FreeInstanceTYPE, fmi3FreeInstance)(c);
}

/* Event mode, until nothing changes. */
static void settle_3(fmi3Instance c)
{
    fmi3Boolean again = fmi3True, ends, nominals, changed, has_next;
    double next;
    while (again)
        wanted(CALL(fmi3UpdateDiscreteStatesTYPE, fmi3UpdateDiscreteStates)(c, &again, &ends, &nominals, &changed,
                                                                            &has_next, &next),
               "event");
    wanted(CALL(fmi3EnterContinuousTimeModeTYPE, fmi3EnterContinuousTimeMode)(c), "event");
}

static void rates_3(fmi3Instance c, double t, const double *at, size_t size, double *rates)
{
    wanted(CALL(fmi3SetTimeTYPE, fmi3SetTime)(c, t), "time");
    wanted(CALL(fmi3SetContinuousStatesTYPE, fmi3SetContinuousStates)(c, at, size), "states");
    wanted(CALL(fmi3GetContinuousStateDerivativesTYPE, fmi3GetContinuousStateDerivatives)(c, rates, size),
           "derivatives");
}

static void exchange_3(const char *token, const char *resources)
{
    fmi3Instance c = begin_3(token, resources, 1);
    const double h = end / steps;
    size_t size = 0;
    wanted(CALL(fmi3GetNumberOfContinuousStatesTYPE, fmi3GetNumberOfContinuousStates)(c, &size), "states");
    if (size > MOST)
        exit(1);
    settle_3(c);
    read_3(c, 0);
    for (int k = 0; k < steps; k++) {
        fmi3Boolean event = fmi3False, ends = fmi3False;
        wanted(CALL(fmi3GetContinuousStatesTYPE, fmi3GetContinuousStates)(c, x, size), "states");
        rates_3(c, k * h, x, size, first);
        for (size_t i = 0; i < size; i++)
            moved[i] = x[i] + h * first[i];
        rates_3(c, (k + 1) * h, moved, size, second);
        for (size_t i = 0; i < size; i++)
            x[i] += h / 2 * (first[i] + second[i]);
        rates_3(c, (k + 1) * h, x, size, first);
        wanted(CALL(fmi3CompletedIntegratorStepTYPE, fmi3CompletedIntegratorStep)(c, fmi3True, &event, &ends),
               "completed step");
        if (event) {
            wanted(CALL(fmi3EnterEventModeTYPE, fmi3EnterEventMode)(c), "event");
            settle_3(c);
        }
        read_3(c, (k + 1) * h);
    }
    CALL(fmi3FreeInstanceTYPE, fmi3FreeInstance)(c);
}

static void read_2(fmi2Component c, double t)
{
    wanted(CALL(fmi2GetRealTYPE, fmi2GetReal)(c, references, (size_t)count, values), "values");
    put_row(t);
}

static void simulate_2(const char *token, const char *resources)
{
    const fmi2CallbackFunctions calls = {.logger = say_2, .allocateMemory = calloc, .freeMemory = free};
    fmi2Component c = CALL(fmi2InstantiateTYPE, fmi2Instantiate)("one", fmi2CoSimulation, token, resources, &calls,
                                                                 fmi2False, fmi2False);
    if (!c)
        exit(1);
    wanted(CALL(fmi2SetupExperimentTYPE, fmi2SetupExperiment)(c, fmi2False, 0, 0, fmi2True, end), "start");
    wanted(CALL(fmi2EnterInitializationModeTYPE, fmi2EnterInitializationMode)(c), "start");
    wanted(CALL(fmi2ExitInitializationModeTYPE, fmi2ExitInitializationMode)(c), "start");
    read_2(c, 0);
    for (int k = 0; k < steps; k++) {
        const double t = end * k / steps, next = end * (k + 1) / steps;
        wanted(CALL(fmi2DoStepTYPE, fmi2DoStep)(c, t, next - t, fmi2True), "step");
        read_2(c, next);
    }
    CALL(fmi2FreeInstanceTYPE, fmi2FreeInstance)(c);
}

int main(int argc, char **argv)
{
    kmp_command_begin(&argc, &argv);
    if (argc < 9)
        return 1;
    library = kmp_library_open(argv[1]);
    if (!library) {
        printf("%s: %s\n", argv[1], kmp_library_reason());
        return 1;
    }
    end = strtod(argv[6], NULL);
    steps = (int)strtol(argv[7], NULL, 10);
    for (count = 0; 8 + count < argc && count < MOST; count++)
        references[count] = (unsigned)strtoul(argv[8 + count], NULL, 10);
    if (strcmp(argv[2], "2") == 0)
        simulate_2(argv[4], argv[5]);
    else if (strcmp(argv[3], "me") == 0)
        exchange_3(argv[4], argv[5]);
    else
        simulate_3(argv[4], argv[5]);
    return 0;
}
