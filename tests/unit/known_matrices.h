/* SPDX-License-Identifier: BSD-3-Clause */
/* Matrices of linear equations against known entries. */
#pragma once

#include "testing.h"
#include <kempe/linearize.h>
#include <stdbool.h>

typedef struct known_matrix {
    kempe_matrix matrix;
    int rows, columns;
    double want[9]; /* by columns */
} known_matrix;

static inline void check_matrices(const kempe_linearization *x, size_t count, const known_matrix *known,
                                  double tolerance)
{
    for (size_t i = 0; x && i < count; i++) {
        int rows = 0, columns = 0;
        const double *found = kempe_linearization_matrix(x, known[i].matrix, &rows, &columns);
        bool fits = rows == known[i].rows && columns == known[i].columns;
        CHECK(fits);
        for (int k = 0; fits && k < rows * columns; k++)
            CHECK_NEAR(found[k], known[i].want[k], tolerance);
    }
}
