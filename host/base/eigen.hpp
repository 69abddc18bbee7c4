#pragma once

// Eigen, as every file of the library includes it. What takes a compiler seconds (decompositions and the
// inner loops of products of matrices whose size is known at run time) is compiled once, in eigen.cpp. That
// holds for arguments that are matrices: hand a decomposition a MatrixXd, not an expression.

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>

#ifndef BTFIELD_INSTANTIATE
#define BTFIELD_INSTANTIATE extern
#endif

namespace btfield::detail {

using RowMajorMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

}  // namespace btfield::detail

namespace Eigen {

// Members one by one: the whole classes hold as much again that nothing here uses.
#define BTFIELD_DECOMPOSITIONS(MATRIX)                                                                      \
    BTFIELD_INSTANTIATE template LLT<MATRIX, Lower>& LLT<MATRIX, Lower>::compute(const EigenBase<MATRIX>&); \
    BTFIELD_INSTANTIATE template void PartialPivLU<MATRIX>::compute();
BTFIELD_DECOMPOSITIONS(MatrixXd)
BTFIELD_DECOMPOSITIONS(MatrixXcd)
#undef BTFIELD_DECOMPOSITIONS
BTFIELD_INSTANTIATE template SelfAdjointEigenSolver<MatrixXd>& SelfAdjointEigenSolver<MatrixXd>::compute(
    const EigenBase<MatrixXd>&, int);

namespace internal {

template <class Scalar>
using Traits = gebp_traits<Scalar, Scalar>;
template <class Scalar, int Order>
using ReadMapper = const_blas_data_mapper<Scalar, Index, Order>;

#define BTFIELD_PRODUCTS_IN_ORDER(SCALAR, LHS, RHS)                                                      \
    BTFIELD_INSTANTIATE template struct general_matrix_vector_product<                                   \
        Index, SCALAR, ReadMapper<SCALAR, LHS>, LHS, false, SCALAR, ReadMapper<SCALAR, RHS>, false, 0>;  \
    BTFIELD_INSTANTIATE template struct general_matrix_matrix_product<Index, SCALAR, LHS, false, SCALAR, \
                                                                      RHS, false, ColMajor, 1>;
#define BTFIELD_PRODUCTS(SCALAR)                                                                             \
    BTFIELD_INSTANTIATE template struct gebp_kernel<SCALAR, SCALAR, Index,                                   \
                                                    blas_data_mapper<SCALAR, Index, ColMajor, Unaligned, 1>, \
                                                    Traits<SCALAR>::mr, Traits<SCALAR>::nr, false, false>;   \
    BTFIELD_PACKING(SCALAR, ColMajor)                                                                        \
    BTFIELD_PACKING(SCALAR, RowMajor)                                                                        \
    BTFIELD_PRODUCTS_IN_ORDER(SCALAR, ColMajor, ColMajor)                                                    \
    BTFIELD_PRODUCTS_IN_ORDER(SCALAR, ColMajor, RowMajor)                                                    \
    BTFIELD_PRODUCTS_IN_ORDER(SCALAR, RowMajor, ColMajor)                                                    \
    BTFIELD_PRODUCTS_IN_ORDER(SCALAR, RowMajor, RowMajor)                                                    \
    BTFIELD_TRIANGULAR_SOLVE(SCALAR, Lower)                                                                  \
    BTFIELD_TRIANGULAR_SOLVE(SCALAR, Upper)                                                                  \
    BTFIELD_TRIANGULAR_SOLVE(SCALAR, UnitLower)
#define BTFIELD_PACKING(SCALAR, ORDER)                                                                 \
    BTFIELD_INSTANTIATE template struct gemm_pack_lhs<SCALAR, Index, ReadMapper<SCALAR, ORDER>,        \
                                                      Traits<SCALAR>::mr, Traits<SCALAR>::LhsProgress, \
                                                      Traits<SCALAR>::LhsPacket4Packing, ORDER>;       \
    BTFIELD_INSTANTIATE template struct gemm_pack_rhs<SCALAR, Index, ReadMapper<SCALAR, ORDER>,        \
                                                      Traits<SCALAR>::nr, ORDER>;
#define BTFIELD_TRIANGULAR_SOLVE(SCALAR, MODE)                                                         \
    BTFIELD_INSTANTIATE template struct triangular_solve_matrix<SCALAR, Index, OnTheLeft, MODE, false, \
                                                                ColMajor, ColMajor, 1>;
BTFIELD_PRODUCTS(double)
BTFIELD_PRODUCTS(std::complex<double>)
#undef BTFIELD_TRIANGULAR_SOLVE
#undef BTFIELD_PACKING
#undef BTFIELD_PRODUCTS
#undef BTFIELD_PRODUCTS_IN_ORDER

}  // namespace internal
}  // namespace Eigen
