/* SPDX-License-Identifier: BSD-3-Clause */
/* A shared library is loaded with all its functions, or the reason is told. */
#include "base/loaded_library.h"
#include "platform/platform.h"
#include "testing.h"
#include <math.h>
#include <string.h>

/* The mathematical functions of C. */
static const char *mathematics(void)
{
    const bool windows = strcmp(kmp_library_ending, ".dll") == 0, macos = strcmp(kmp_library_ending, ".dylib") == 0;
    return windows ? "msvcrt.dll" : macos ? "/usr/lib/libSystem.B.dylib" : "libm.so.6";
}

static void functions_of_a_library(void)
{
    static const char *const names[] = {"cos", "pow"};
    struct {
        double (*cosine)(double x);
        double (*power)(double x, double y);
    } found;
    kmp_loaded_library library = KMP_LOADED_LIBRARY(mathematics(), names, &found);
    CHECK(!kmp_library_missing(&library));
    CHECK_NEAR(found.cosine(1.0), 0.5403023058681398, 1e-15);
    CHECK_NEAR(found.power(2.0, 10.0), 1024.0, 0.0);
    found.cosine = NULL; /* a second question loads nothing */
    CHECK(!kmp_library_missing(&library) && !found.cosine);
}

static void missing_library(void)
{
    static const char *const names[] = {"cos"};
    double (*cosine)(double x) = NULL;
    kmp_loaded_library library = KMP_LOADED_LIBRARY("no_such_library.so", names, &cosine);
    const char *why = kmp_library_missing(&library);
    CHECK(why && *why && !cosine);
    CHECK(kmp_library_missing(&library) == why);
}

static void missing_function(void)
{
    static const char *const names[] = {"cos", "no_such_function_of_mathematics"};
    void *found[2] = {NULL, NULL};
    kmp_loaded_library library = KMP_LOADED_LIBRARY(mathematics(), names, found);
    const char *why = kmp_library_missing(&library);
    CHECK(why && *why && !found[1]);
}

int main(void)
{
    TEST(functions_of_a_library);
    TEST(missing_library);
    TEST(missing_function);
    return check_report();
}
