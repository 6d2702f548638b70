// SPDX-License-Identifier: BSD-3-Clause
// Arithmetic of 113 bits for the programs examples/NAME/reference_NAME.c: dense linear systems, an integrator, rows of
// CSV. GCC's __float128 and libquadmath. A program prints its table; an argument is the tolerance of its steps.
// examples/references/run builds it, runs it and compares.
#ifndef KEMPE_EXAMPLES_QUAD_H
#define KEMPE_EXAMPLES_QUAD_H

#include <quadmath.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef __float128 quad;

enum {
    MOST = 64,   // numbers of a state, unknowns of a system
    COLUMNS = 12 // of the table of extrapolation: order 24
};

static inline quad degrees(quad angle)
{
    return angle * M_PIq / 180;
}

static inline quad squared(quad x)
{
    return x * x;
}

// a x = b by Gauss's elimination with partial pivoting; a is n x n by rows, b becomes x.
static inline void solve(int n, quad *a, quad *b)
{
    for (int k = 0; k < n; k++) {
        int pivot = k;
        for (int i = k + 1; i < n; i++)
            if (fabsq(a[i * n + k]) > fabsq(a[pivot * n + k]))
                pivot = i;
        for (int j = 0; j < n; j++) {
            quad other = a[k * n + j];
            a[k * n + j] = a[pivot * n + j];
            a[pivot * n + j] = other;
        }
        quad other = b[k];
        b[k] = b[pivot];
        b[pivot] = other;
        for (int i = k + 1; i < n; i++) {
            quad factor = a[i * n + k] / a[k * n + k];
            if (factor == 0)
                continue;
            for (int j = k + 1; j < n; j++)
                a[i * n + j] -= factor * a[k * n + j];
            b[i] -= factor * b[k];
        }
    }
    for (int k = n - 1; k >= 0; k--) {
        for (int j = k + 1; j < n; j++)
            b[k] -= a[k * n + j] * b[j];
        b[k] /= a[k * n + k];
    }
}

// Derivative of a state of n numbers.
typedef void rates_function(quad t, const quad *state, quad *rate);

// The modified midpoint rule (Gragg) over h in n steps.
static inline void midpoint(rates_function *rates, quad t, int count, const quad *state, quad h, int n, quad *out)
{
    quad before[MOST], now[MOST], rate[MOST], d = h / n;
    rates(t, state, rate);
    for (int i = 0; i < count; i++) {
        before[i] = state[i];
        now[i] = state[i] + d * rate[i];
    }
    for (int k = 1; k < n; k++) {
        rates(t + k * d, now, rate);
        for (int i = 0; i < count; i++) {
            quad next = before[i] + 2 * d * rate[i];
            before[i] = now[i];
            now[i] = next;
        }
    }
    rates(t + h, now, rate);
    for (int i = 0; i < count; i++)
        out[i] = (before[i] + now[i] + d * rate[i]) / 2;
}

// Extrapolation of the midpoint rule to steps of no length (Bulirsch and Stoer), as in ../extrapolation.py. Returns the
// largest difference between the last two columns, relative to 1 + |x|.
static inline quad extrapolated(rates_function *rates, quad t, int count, const quad *state, quad h, quad *out)
{
    quad rows[2][COLUMNS][MOST], most = 0;
    const int end = COLUMNS - 1;
    for (int k = 0; k < COLUMNS; k++) {
        quad(*now)[MOST] = rows[k % 2], (*last)[MOST] = rows[(k + 1) % 2];
        midpoint(rates, t, count, state, h, 2 * (k + 1), now[0]);
        for (int j = 0; j < k; j++) {
            quad ratio = squared((quad)(k + 1) / (k - j)) - 1;
            for (int i = 0; i < count; i++)
                now[j + 1][i] = now[j][i] + (now[j][i] - last[j][i]) / ratio;
        }
    }
    for (int i = 0; i < count; i++) {
        out[i] = rows[end % 2][end][i];
        most = fmaxq(most, fabsq(out[i] - rows[end % 2][end - 1][i]) / (1 + fabsq(out[i])));
    }
    return isnanq(out[0]) ? HUGE_VALQ : most;
}

// The tolerance of steps: the program's argument.
static inline quad tolerance(int argc, char **argv)
{
    return argc > 1 ? strtoflt128(argv[1], NULL) : 1e-20Q;
}

// Brings a state from one time to another; the length of the first step may be told, and that of the last one is left
// in h.
static inline void integrate(rates_function *rates, quad from, quad to, quad allowed, quad *h, int count, quad *state)
{
    quad t = from, out[MOST];
    while (t < to) {
        quad left = to - t, step = fminq(*h, left);
        quad error = extrapolated(rates, t, count, state, step, out);
        quad factor = fmaxq(0.2Q, fminq(3, 0.9Q * powq(allowed / fmaxq(error, 1e-40Q), 1 / (2.Q * COLUMNS - 1))));
        if (error <= allowed) {
            t = step == left ? to : t + step;
            memcpy(state, out, (size_t)count * sizeof *state);
        }
        if (error > allowed || step == *h || factor < 1)
            *h = step * factor;
    }
}

// A row of the table: a time, then numbers with so many significant digits.
static inline void row(quad t, int count, const quad *values, int digits)
{
    char text[80];
    printf("%g", (double)t);
    for (int i = 0; i < count; i++) {
        quadmath_snprintf(text, sizeof text, "%#.*Qg", digits, values[i]);
        printf(",%s", text);
    }
    printf("\n");
}

#endif
