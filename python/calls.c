/* SPDX-License-Identifier: BSD-3-Clause */
/* Evaluation at one state from arrays as they are, for programs that repeat it. A call through cffi makes an object for
 * each array; here an array costs a look at its buffer. The module kempe._calls is in the file of kempe._native. Its
 * functions have the names of those in C, take the address of a workspace, n and m, and return the status, or CONVERT
 * where an argument is no contiguous array of float64 of the right length. */
#define Py_LIMITED_API 0x030b0000
#include <Python.h>
#include <kempe/workspace.h>
#include <stdbool.h>
#include <string.h>

enum { MOST_ARRAYS = 5, CONVERT = 1000 };

typedef struct python_call {
    PyObject *const *next; /* arguments that are still to be read */
    kempe_workspace *workspace;
    Py_ssize_t n, m;
    double t;
    Py_buffer views[MOST_ARRAYS];
    int count;
    bool plain; /* all arrays so far can be used as they are */
} python_call;

/* Reads workspace, n, m and t; false: Python has an exception. */
static bool begin(python_call *call, PyObject *const *arguments, Py_ssize_t given, Py_ssize_t arrays)
{
    call->next = arguments + 4;
    call->count = 0;
    call->plain = true;
    if (given != 4 + arrays) {
        PyErr_SetString(PyExc_TypeError, "workspace, n, m, t and arrays are needed");
        return false;
    }
    call->workspace = PyLong_AsVoidPtr(arguments[0]);
    call->n = PyLong_AsSsize_t(arguments[1]);
    call->m = PyLong_AsSsize_t(arguments[2]);
    call->t = PyFloat_AsDouble(arguments[3]);
    return !PyErr_Occurred();
}

/* The next array, of `count` numbers; NULL for None. */
static double *doubles(python_call *call, Py_ssize_t count, int writable)
{
    PyObject *array = *call->next++;
    Py_buffer *view = call->views + call->count;
    if (array == Py_None)
        return NULL;
    if (PyObject_GetBuffer(array, view, PyBUF_ND | PyBUF_FORMAT | writable)) {
        PyErr_Clear();
        call->plain = false;
        return NULL;
    }
    call->count++;
    call->plain &= view->ndim == 1 && view->shape[0] == count && view->format && !strcmp(view->format, "d");
    return view->buf;
}

static PyObject *end(python_call *call, int status)
{
    while (call->count)
        PyBuffer_Release(call->views + --call->count);
    return PyLong_FromLong(call->plain ? status : CONVERT);
}

/* (t, q, qd) */
static PyObject *evaluate(PyObject *module, PyObject *const *arguments, Py_ssize_t given)
{
    (void)module;
    python_call call;
    if (!begin(&call, arguments, given, 2))
        return NULL;
    kempe_status status = KEMPE_OK;
    const double *q = doubles(&call, call.n, 0), *qd = doubles(&call, call.n, 0);
    if (call.plain) {
        Py_BEGIN_ALLOW_THREADS status = kempe_workspace_evaluate(call.workspace, call.t, q, qd);
        Py_END_ALLOW_THREADS
    }
    return end(&call, status);
}

/* (t, q, qd, Q or None; qdd, lam) */
static PyObject *forward_dynamics(PyObject *module, PyObject *const *arguments, Py_ssize_t given)
{
    (void)module;
    python_call call;
    if (!begin(&call, arguments, given, 5))
        return NULL;
    kempe_status status = KEMPE_OK;
    const double *q = doubles(&call, call.n, 0), *qd = doubles(&call, call.n, 0), *Q = doubles(&call, call.n, 0);
    double *qdd = doubles(&call, call.n, PyBUF_WRITABLE), *lam = doubles(&call, call.m, PyBUF_WRITABLE);
    if (call.plain) {
        Py_BEGIN_ALLOW_THREADS status = kempe_workspace_forward_dynamics(call.workspace, call.t, q, qd, Q, qdd, lam);
        Py_END_ALLOW_THREADS
    }
    return end(&call, status);
}

/* (t, q, qd, qdd; Q) */
static PyObject *inverse_dynamics(PyObject *module, PyObject *const *arguments, Py_ssize_t given)
{
    (void)module;
    python_call call;
    if (!begin(&call, arguments, given, 4))
        return NULL;
    kempe_status status = KEMPE_OK;
    const double *q = doubles(&call, call.n, 0), *qd = doubles(&call, call.n, 0), *qdd = doubles(&call, call.n, 0);
    double *Q = doubles(&call, call.n, PyBUF_WRITABLE);
    if (call.plain) {
        Py_BEGIN_ALLOW_THREADS status = kempe_workspace_inverse_dynamics(call.workspace, call.t, q, qd, qdd, Q);
        Py_END_ALLOW_THREADS
    }
    return end(&call, status);
}

#define ROW(name, function)                                                                                            \
    {                                                                                                                  \
        name, (PyCFunction)(void (*)(void))function, METH_FASTCALL, NULL                                               \
    }

static PyMethodDef methods[] = {
    ROW("kempe_workspace_evaluate", evaluate),
    ROW("kempe_workspace_forward_dynamics", forward_dynamics),
    ROW("kempe_workspace_inverse_dynamics", inverse_dynamics),
    {NULL, NULL, 0, NULL},
};

static PyModuleDef definition = {PyModuleDef_HEAD_INIT, "_calls", NULL, -1, methods, NULL, NULL, NULL, NULL};

PyMODINIT_FUNC PyInit__calls(void)
{
    PyObject *module = PyModule_Create(&definition);
    if (module)
        PyModule_AddIntConstant(module, "CONVERT", CONVERT);
    return module;
}
