/* SPDX-License-Identifier: BSD-3-Clause */
/* A test program is `int main(void) { TEST(name); ... return check_report(); }`. Each TEST prints one line,
 * each failing CHECK one sentence with its place. */
#ifndef KEMPE_TESTS_TESTING_H
#define KEMPE_TESTS_TESTING_H

#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>

static int check_failures, check_tests, check_failed_tests;

#define CHECK(condition)                                                                                               \
    do {                                                                                                               \
        if (!(condition)) {                                                                                            \
            check_failures++;                                                                                          \
            printf("%s:%d: not true: %s\n", __FILE__, __LINE__, #condition);                                           \
        }                                                                                                              \
    } while (0)

/* |a - b| <= tolerance * max(|b|, 1) */
#define CHECK_NEAR(a, b, tolerance)                                                                                    \
    do {                                                                                                               \
        double check_a = (a), check_b = (b), check_t = (tolerance);                                                    \
        if (!(fabs(check_a - check_b) <= check_t * fmax(fabs(check_b), 1.0))) {                                        \
            check_failures++;                                                                                          \
            printf("%s:%d: %s = %.17g, expected %.17g (off %.3g, allowed %.3g relative)\n", __FILE__, __LINE__, #a,    \
                   check_a, check_b, check_a - check_b, check_t);                                                      \
        }                                                                                                              \
    } while (0)

#define CHECK_TEXT(a, b)                                                                                               \
    do {                                                                                                               \
        const char *check_s = (a), *check_r = (b);                                                                     \
        if (strcmp(check_s, check_r) != 0) {                                                                           \
            check_failures++;                                                                                          \
            printf("%s:%d: %s is\n%s\nexpected\n%s\n", __FILE__, __LINE__, #a, check_s, check_r);                      \
        }                                                                                                              \
    } while (0)

/* The larger one; no number, if either is none: fmax drops it, and nothing would fail. */
static inline double check_max(double a, double b)
{
    return isnan(a) || b <= a ? a : b;
}

/* The largest difference of numbers over the largest of the second ones; no number, if any is none. */
static inline double check_apart(int count, const double *a, const double *b)
{
    double off = 0, size = 1e-300;
    for (int i = 0; i < count; i++) {
        off = check_max(off, fabs(a[i] - b[i]));
        size = check_max(size, fabs(b[i]));
    }
    return off / size;
}

/* True if a text says these words, also where they are broken into lines: all blanks and ends of lines are the same. */
static inline bool check_says(const char *text, const char *words)
{
    static const char *const blanks = " \n";
    for (; text && *text; text++) {
        const char *t = text, *w = words;
        while (*w && (*w == *t || (strspn(w, blanks) > 0 && strspn(t, blanks) > 0))) {
            const size_t skipped = strspn(w, blanks);
            t += skipped > 0 ? strspn(t, blanks) : 1;
            w += skipped > 0 ? skipped : 1;
        }
        if (!*w)
            return true;
    }
    return false;
}

#define TEST(function)                                                                                                 \
    do {                                                                                                               \
        int check_before = check_failures;                                                                             \
        function();                                                                                                    \
        check_tests++;                                                                                                 \
        check_failed_tests += check_failures > check_before;                                                           \
        printf("%s %s\n", check_failures > check_before ? "FAILED" : "ok", #function);                                 \
    } while (0)

static int check_report(void)
{
    printf("%d passed, %d failed\n", check_tests - check_failed_tests, check_failed_tests);
    return check_tests == 0 || check_failed_tests > 0;
}

#endif
