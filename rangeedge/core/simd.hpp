// Short vectors for the innermost loops.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstring>

// Marks functions that are compiled a second time for processors with AVX2 and chosen at load time. Without
// contraction both forms round alike. Sanitizers cannot run that early.
#if defined(__x86_64__) && defined(__gnu_linux__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)
#define RANGEEDGE_WIDE __attribute__((target_clones("avx2", "default")))
#else
#define RANGEEDGE_WIDE
#endif

namespace rangeedge {

typedef float Float4 __attribute__((vector_size(16)));
typedef double Double4 __attribute__((vector_size(32)));
typedef float Float8 __attribute__((vector_size(32)));
typedef int Int8 __attribute__((vector_size(32)));

}  // namespace rangeedge
