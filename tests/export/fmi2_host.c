/* An importer of its own: what a host may do with a unit, in any order. The names are those of FMI 2.0. */
#include <math.h>
#include <stddef.h>
#include <stdio.h>

void *fmi2Instantiate(const char *, int, const char *, const char *, const void *, int, int);
void fmi2FreeInstance(void *);
int fmi2SetupExperiment(void *, int, double, double, int, double);
int fmi2EnterInitializationMode(void *);
int fmi2ExitInitializationMode(void *);
int fmi2Terminate(void *);
int fmi2Reset(void *);
int fmi2GetReal(void *, const unsigned[], size_t, double[]);
int fmi2GetInteger(void *, const unsigned[], size_t, int[]);
int fmi2GetBoolean(void *, const unsigned[], size_t, int[]);
int fmi2GetString(void *, const unsigned[], size_t, const char *[]);
int fmi2SetReal(void *, const unsigned[], size_t, const double[]);
int fmi2SetInteger(void *, const unsigned[], size_t, const int[]);
int fmi2SetBoolean(void *, const unsigned[], size_t, const int[]);
int fmi2GetFMUstate(void *, void **);
int fmi2SetFMUstate(void *, void *);
int fmi2FreeFMUstate(void *, void **);
int fmi2SerializedFMUstateSize(void *, void *, size_t *);
int fmi2SerializeFMUstate(void *, void *, char[], size_t);
int fmi2DeSerializeFMUstate(void *, const char[], size_t, void **);
int fmi2DoStep(void *, double, double, int);
int fmi2GetStatus(void *, int, int *);

#define CHECK(holds) if (!(holds)) { printf("line %d: %s\n", __LINE__, #holds); return 1; }

static const unsigned inputs[] = {0, 1, 2}, outputs[] = {3}, codes[] = {6, 7}, primed[] = {8}, after[] = {9};

static int misuse(const char *guid)
{
    const unsigned wrong[] = {10}, output[] = {3}, fill[] = {0};
    const double bad = NAN, other = 0.123;
    double value = 0.0;
    int code[2], on = 1;
    char bytes[512];
    size_t size = 0;
    void *kept = NULL, *again = NULL, *a, *b;
    CHECK(fmi2Instantiate("x", 1, "another law", NULL, NULL, 0, 0) == NULL)
    CHECK(fmi2Instantiate("x", 0, guid, NULL, NULL, 0, 0) == NULL)
    a = fmi2Instantiate("a", 1, guid, NULL, NULL, 0, 0);
    b = fmi2Instantiate("b", 1, guid, NULL, NULL, 0, 0);
    CHECK(a && b && a != b)
    CHECK(fmi2GetReal(a, wrong, 1, &value) == 3 && fmi2SetReal(a, wrong, 1, &other) == 3)
    CHECK(fmi2SetReal(a, output, 1, &other) == 3 && fmi2SetInteger(a, codes, 1, &on) == 3)
    CHECK(fmi2GetReal(a, codes, 1, &value) == 3 && fmi2GetBoolean(a, fill, 1, &on) == 3)
    CHECK(fmi2SetBoolean(a, after, 1, &on) == 3 && fmi2GetString(a, fill, 1, NULL) == 3)
    CHECK(fmi2GetReal(NULL, fill, 1, &value) == 3 && fmi2GetReal(a, NULL, 1, &value) == 3)
    CHECK(fmi2GetReal(a, NULL, 0, NULL) == 0 && fmi2DoStep(a, 0.0, -1.0, 0) == 3 && fmi2GetStatus(a, 0, &on) == 2)
    CHECK(fmi2SetReal(a, fill, 1, &bad) == 0 && fmi2GetInteger(a, codes, 2, code) == 0 && code[1] == 4)
    CHECK(fmi2GetReal(a, output, 1, &value) == 0 && value == 0.0)
    CHECK(fmi2GetReal(b, fill, 1, &value) == 0 && value == value)
    CHECK(fmi2Reset(a) == 0 && fmi2GetReal(a, fill, 1, &value) == 0 && value == value)
    CHECK(fmi2SetReal(a, fill, 1, &other) == 0 && fmi2GetFMUstate(a, &kept) == 0 && fmi2Reset(a) == 0)
    CHECK(fmi2SerializedFMUstateSize(a, kept, &size) == 0 && size <= sizeof bytes)
    CHECK(fmi2SerializeFMUstate(a, kept, bytes, size - 1) == 3 && fmi2SerializeFMUstate(a, kept, bytes, size) == 0)
    CHECK(fmi2DeSerializeFMUstate(b, bytes, size, &again) == 0 && fmi2SetFMUstate(b, again) == 0)
    CHECK(fmi2GetReal(b, fill, 1, &value) == 0 && value == other)
    fmi2FreeInstance(a);
    CHECK(fmi2FreeFMUstate(b, &again) == 0 && again == NULL && fmi2FreeFMUstate(b, &again) == 0)
    CHECK(fmi2FreeFMUstate(b, &kept) == 0)
    fmi2FreeInstance(b);
    fmi2FreeInstance(NULL);
    return 0;
}

int main(int count, char **arguments)
{
    double x[3], y[1];
    int flag, code[2];
    void *unit;
    if (count != 2 || misuse(arguments[1])) {
        return 1;
    }
    unit = fmi2Instantiate("law", 1, arguments[1], NULL, NULL, 0, 0);
    CHECK(unit && !fmi2SetupExperiment(unit, 0, 0.0, 0.0, 0, 0.0) && !fmi2EnterInitializationMode(unit))
    CHECK(!fmi2ExitInitializationMode(unit))
    while (scanf("%lf,%lf,%lf,%d", x, x + 1, x + 2, &flag) == 4) {
        CHECK(!fmi2SetReal(unit, inputs, 3, x) && !fmi2SetBoolean(unit, primed, 1, &flag))
        CHECK(!fmi2DoStep(unit, 0.0, 0.1, 0) && !fmi2GetReal(unit, outputs, 1, y))
        CHECK(!fmi2GetInteger(unit, codes, 2, code) && !fmi2GetBoolean(unit, after, 1, &flag))
        printf("%.17g,%d,%d,%d\n", y[0], code[0], code[1], flag);
    }
    CHECK(!fmi2Terminate(unit))
    fmi2FreeInstance(unit);
    return 0;
}
