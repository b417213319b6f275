// Hot loops are compiled for several instruction sets, and the version that fits the processor is
// chosen when the library is loaded: one binary is fast on a laptop and on every node of a mixed
// cluster. The macro stands before the definition of a function.

#pragma once

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && defined(__linux__) && \
    !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define INELASTIC_HAS_CLONES
#ifdef INELASTIC_WITHOUT_AVX512
#define INELASTIC_CLONES __attribute__((target_clones("default", "arch=x86-64-v3")))
#else
#define INELASTIC_CLONES \
  __attribute__((target_clones("default", "arch=x86-64-v3", "arch=x86-64-v4")))
#endif
#else
#define INELASTIC_CLONES
#endif
