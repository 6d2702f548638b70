/* SPDX-License-Identifier: BSD-3-Clause */
/* Includes the table of operations and forgets the row macros after it; no guard, for each use has its own macros. */
#include "symbolic/ops.def"
#undef KMP_LEAF
#undef KMP_BINARY
#undef KMP_UNARY
#undef KMP_BINARY_FUNCTION
#undef KMP_TERNARY
#undef KMP_APPLIED
