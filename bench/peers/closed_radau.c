// SPDX-License-Identifier: BSD-3-Clause
// Hairer and Wanner's Fortran code RADAU on equations of a plane mechanism (planar.py): closed_radau T_END TOLERANCE
// ... Stages 3: their RADAU5; 3 to 7: the order is variable. The reduced ODE, and the index-3 DAE of angles, rates,
// accelerations and multipliers. Jacobians are exact. Prints `way|tolerance|seconds of processor time|q ...`, q empty
// where a run broke off.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

// Written by `run` beside the mechanism.
enum { MOST = 400 };
extern const int angles, independent, reduced_size, descriptor_size;
extern const double reduced_start[], descriptor_start[];
void reduced_rates(const double *y, double *f);
void reduced_jacobian(const double *y, double *f);
void descriptor_rates(const double *y, double *f);
void descriptor_jacobian(const double *y, double *f);

typedef void fcn(const int *, const double *, const double *, double *, double *, int *);
typedef void jac(const int *, const double *, const double *, double *, const int *, double *, int *);
typedef void mas(const int *, double *, const int *, double *, int *);
typedef void solout(const int *, const double *, const double *, const double *, const double *, const int *,
                    const int *, double *, int *, int *);
void radau_(const int *n, fcn *f, double *x, double *y, const double *end, double *h, const double *rtol,
            const double *atol, const int *itol, jac *j, const int *ijac, const int *mljac, const int *mujac, mas *m,
            const int *imas, const int *mlmas, const int *mumas, solout *s, const int *iout, double *work,
            const int *lwork, int *iwork, const int *liwork, double *rpar, int *ipar, int *idid, char *errors,
            long length);

static int descriptor; // the one of the two that runs
static long calls;

static void rates(const int *n, const double *x, const double *y, double *f, double *rpar, int *ipar)
{
    (void)n, (void)x, (void)rpar, (void)ipar;
    calls++;
    (descriptor ? descriptor_rates : reduced_rates)(y, f);
}

// The generated function has them by columns, as Fortran has.
static void jacobian(const int *n, const double *x, const double *y, double *f, const int *ld, double *rpar, int *ipar)
{
    (void)n, (void)x, (void)ld, (void)rpar, (void)ipar;
    (descriptor ? descriptor_jacobian : reduced_jacobian)(y, f);
}

// Diagonal: ones for q and v, zeros for a and lambda.
static void mass(const int *n, double *m, const int *ld, double *rpar, int *ipar)
{
    (void)ld, (void)rpar, (void)ipar;
    for (int i = 0; i < *n; i++)
        m[i] = i < 2 * angles ? 1 : 0;
}

static void nothing(const int *nr, const double *xold, const double *x, const double *y, const double *cont,
                    const int *lrc, const int *n, double *rpar, int *ipar, int *irtrn)
{
    (void)nr, (void)xold, (void)x, (void)y, (void)cont, (void)lrc, (void)n, (void)rpar, (void)ipar, (void)irtrn;
}

// One run; 1 for success.
static int integrate(double end, double tolerance, int stages, double *y)
{
    static double work[20 + 16 * MOST * MOST + 100 * MOST];
    static int iwork[20 + 10 * MOST];
    const int n = descriptor ? descriptor_size : reduced_size, zero = 0, one = 1, is_mass = descriptor;
    const int lwork = sizeof work / sizeof *work, liwork = sizeof iwork / sizeof *iwork;
    double x = 0, h = 1e-6, rpar = 0;
    int ipar = 0, idid = 0;
    char errors[1024];
    memset(work, 0, 20 * sizeof *work);
    memset(iwork, 0, 20 * sizeof *iwork);
    memcpy(y, descriptor ? descriptor_start : reduced_start, (size_t)n * sizeof *y);
    if (descriptor) {
        iwork[4] = angles;
        iwork[5] = angles;
        iwork[6] = n - 2 * angles;
    }
    iwork[1] = 2000000;
    iwork[10] = 3;
    iwork[11] = stages;
    radau_(&n, rates, &x, y, &end, &h, &tolerance, &tolerance, &zero, jacobian, &one, &n, &n, mass, &is_mass, &zero,
           &zero, nothing, &zero, work, &lwork, iwork, &liwork, &rpar, &ipar, &idid, errors, sizeof errors);
    return idid == 1;
}

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

int main(int argc, char **argv)
{
    static double y[MOST];
    for (int k = 0; k < 4; k++) {
        const int stages = k % 2 ? 7 : 3;
        descriptor = k / 2;
        for (int i = 2; i < argc; i++) {
            double begin = now(), seconds = 0;
            int count = 0, good = 1;
            while (good && (count == 0 || seconds < 0.02)) {
                good = integrate(atof(argv[1]), atof(argv[i]), stages, y);
                seconds = now() - begin;
                count++;
            }
            printf("%s, %s, rtol|%s|%.6g|", stages == 3 ? "RADAU5 (Fortran)" : "RADAU, orders 5 to 13 (Fortran)",
                   descriptor ? "index 3" : "reduced ODE", argv[i], seconds / count);
            for (int j = 0; good && j < angles; j++)
                printf("%s%.17g", j ? " " : "", y[j]);
            printf("\n");
            fflush(stdout);
            if (seconds / count > 2)
                break;
        }
    }
    return 0;
}
