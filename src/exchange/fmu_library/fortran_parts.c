/* SPDX-License-Identifier: BSD-3-Clause */
/* The two further routines that LAPACK needs, so that a unit does without the library of the Fortran compiler. */
#include <string.h>

void xerbla_(const char *name, const int *argument, size_t length);
/* The name is defined by the Fortran compiler. */
void _gfortran_concat_string(size_t size, char *to, size_t first_size, const char *first, size_t second_size,
                             const char *second);

/* The report of a wrong argument of a routine: Kempe checks the numbers that come out. */
void xerbla_(const char *name, const int *argument, size_t length)
{
    (void)name, (void)argument, (void)length;
}

static size_t copy(char *to, size_t room, const char *from, size_t size)
{
    size_t count = size < room ? size : room;
    memcpy(to, from, count);
    return count;
}

/* first // second, with spaces to the end. */
void _gfortran_concat_string(size_t size, char *to, size_t first_size, const char *first, size_t second_size,
                             const char *second)
{
    size_t used = copy(to, size, first, first_size);
    used += copy(to + used, size - used, second, second_size);
    memset(to + used, ' ', size - used);
}
