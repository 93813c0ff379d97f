/* An importer of its own: what a host may do with a unit, in any order. The names are those of FMI 3.0. */
#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

void *fmi3InstantiateCoSimulation(const char *, const char *, const char *, bool, bool, bool, bool, const unsigned[],
                                  size_t, void *, void (*)(void *, int, const char *, const char *), void (*)(void));
void fmi3FreeInstance(void *);
int fmi3EnterInitializationMode(void *, bool, double, double, bool, double);
int fmi3ExitInitializationMode(void *);
int fmi3Terminate(void *);
int fmi3Reset(void *);
int fmi3GetFloat64(void *, const unsigned[], size_t, double[], size_t);
int fmi3GetInt32(void *, const unsigned[], size_t, int32_t[], size_t);
int fmi3GetBoolean(void *, const unsigned[], size_t, bool[], size_t);
int fmi3GetString(void *, const unsigned[], size_t, const char *[], size_t);
int fmi3SetFloat64(void *, const unsigned[], size_t, const double[], size_t);
int fmi3SetInt32(void *, const unsigned[], size_t, const int32_t[], size_t);
int fmi3SetBoolean(void *, const unsigned[], size_t, const bool[], size_t);
int fmi3GetFMUState(void *, void **);
int fmi3SetFMUState(void *, void *);
int fmi3FreeFMUState(void *, void **);
int fmi3SerializedFMUStateSize(void *, void *, size_t *);
int fmi3SerializeFMUState(void *, void *, uint8_t[], size_t);
int fmi3DeserializeFMUState(void *, const uint8_t[], size_t, void **);
int fmi3DoStep(void *, double, double, bool, bool *, bool *, bool *, double *);

#define CHECK(holds) if (!(holds)) { printf("line %d: %s\n", __LINE__, #holds); return 1; }

static const unsigned inputs[] = {0, 1, 2}, outputs[] = {3}, codes[] = {6, 7}, primed[] = {8}, after[] = {9};

static int misuse(const char *guid)
{
    const unsigned wrong[] = {11}, output[] = {3}, fill[] = {0};
    const double bad = NAN, other = 0.123;
    double value = 0.0;
    int32_t code[2];
    bool on = true, event, ended, early;
    double last;
    uint8_t bytes[512];
    size_t size = 0;
    void *kept = NULL, *again = NULL, *a, *b;
    CHECK(fmi3InstantiateCoSimulation("x", "another law", NULL, 0, 0, 0, 0, NULL, 0, NULL, NULL, NULL) == NULL)
    CHECK(fmi3InstantiateCoSimulation("x", NULL, NULL, 0, 0, 0, 0, NULL, 0, NULL, NULL, NULL) == NULL)
    a = fmi3InstantiateCoSimulation("a", guid, NULL, 0, 0, 0, 0, NULL, 0, NULL, NULL, NULL);
    b = fmi3InstantiateCoSimulation("b", guid, NULL, 0, 0, 0, 0, NULL, 0, NULL, NULL, NULL);
    CHECK(a && b && a != b)
    CHECK(fmi3GetFloat64(a, wrong, 1, &value, 1) == 3 && fmi3SetFloat64(a, wrong, 1, &other, 1) == 3)
    CHECK(fmi3SetFloat64(a, output, 1, &other, 1) == 3 && fmi3SetInt32(a, codes, 1, code, 1) == 3)
    CHECK(fmi3GetFloat64(a, codes, 1, &value, 1) == 3 && fmi3GetBoolean(a, fill, 1, &on, 1) == 3)
    CHECK(fmi3SetBoolean(a, after, 1, &on, 1) == 3 && fmi3GetString(a, fill, 1, NULL, 1) == 3)
    CHECK(fmi3GetFloat64(NULL, fill, 1, &value, 1) == 3 && fmi3GetFloat64(a, NULL, 1, &value, 1) == 3)
    CHECK(fmi3GetFloat64(a, NULL, 0, NULL, 0) == 0 && fmi3DoStep(a, 0.0, -1.0, 0, &event, &ended, &early, &last) == 3)
    CHECK(fmi3SetFloat64(a, fill, 1, &bad, 1) == 0 && fmi3GetInt32(a, codes, 2, code, 2) == 0 && code[1] == 4)
    CHECK(fmi3GetFloat64(a, output, 1, &value, 1) == 0 && value == 0.0)
    CHECK(fmi3GetFloat64(b, fill, 1, &value, 1) == 0 && value == value)
    CHECK(fmi3Reset(a) == 0 && fmi3GetFloat64(a, fill, 1, &value, 1) == 0 && value == value)
    CHECK(fmi3SetFloat64(a, fill, 1, &other, 1) == 0 && fmi3GetFMUState(a, &kept) == 0 && fmi3Reset(a) == 0)
    CHECK(fmi3SerializedFMUStateSize(a, kept, &size) == 0 && size <= sizeof bytes)
    CHECK(fmi3SerializeFMUState(a, kept, bytes, size - 1) == 3 && fmi3SerializeFMUState(a, kept, bytes, size) == 0)
    CHECK(fmi3DeserializeFMUState(b, bytes, size, &again) == 0 && fmi3SetFMUState(b, again) == 0)
    CHECK(fmi3GetFloat64(b, fill, 1, &value, 1) == 0 && value == other)
    fmi3FreeInstance(a);
    CHECK(fmi3FreeFMUState(b, &again) == 0 && again == NULL && fmi3FreeFMUState(b, &again) == 0)
    CHECK(fmi3FreeFMUState(b, &kept) == 0)
    fmi3FreeInstance(b);
    fmi3FreeInstance(NULL);
    return 0;
}

int main(int count, char **arguments)
{
    double x[3], y[1];
    int flag;
    int32_t code[2];
    bool on, event, ended, early;
    double last;
    void *unit;
    if (count != 2 || misuse(arguments[1])) {
        return 1;
    }
    unit = fmi3InstantiateCoSimulation("law", arguments[1], NULL, 0, 0, 0, 0, NULL, 0, NULL, NULL, NULL);
    CHECK(unit && !fmi3EnterInitializationMode(unit, 0, 0.0, 0.0, 0, 0.0))
    CHECK(!fmi3ExitInitializationMode(unit))
    while (scanf("%lf,%lf,%lf,%d", x, x + 1, x + 2, &flag) == 4) {
        on = flag != 0;
        CHECK(!fmi3SetFloat64(unit, inputs, 3, x, 3) && !fmi3SetBoolean(unit, primed, 1, &on, 1))
        CHECK(!fmi3DoStep(unit, 0.0, 0.1, 0, &event, &ended, &early, &last) && !fmi3GetFloat64(unit, outputs, 1, y, 1))
        CHECK(!fmi3GetInt32(unit, codes, 2, code, 2) && !fmi3GetBoolean(unit, after, 1, &on, 1))
        printf("%.17g,%d,%d,%d\n", y[0], code[0], code[1], on);
    }
    CHECK(!fmi3Terminate(unit))
    fmi3FreeInstance(unit);
    return 0;
}
