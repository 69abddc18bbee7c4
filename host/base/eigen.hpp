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

namespace Eigen {

BTFIELD_INSTANTIATE template class LLT<MatrixXd, Lower>;
BTFIELD_INSTANTIATE template LLT<MatrixXd, Lower>& LLT<MatrixXd, Lower>::compute(const EigenBase<MatrixXd>&);
BTFIELD_INSTANTIATE template class PartialPivLU<MatrixXd>;
BTFIELD_INSTANTIATE template PartialPivLU<MatrixXd>::PartialPivLU(const EigenBase<MatrixXd>&);
BTFIELD_INSTANTIATE template class PartialPivLU<MatrixXcd>;
BTFIELD_INSTANTIATE template PartialPivLU<MatrixXcd>::PartialPivLU(const EigenBase<MatrixXcd>&);
BTFIELD_INSTANTIATE template class SelfAdjointEigenSolver<MatrixXd>;
BTFIELD_INSTANTIATE template SelfAdjointEigenSolver<MatrixXd>& SelfAdjointEigenSolver<MatrixXd>::compute(
    const EigenBase<MatrixXd>&, int);

namespace internal {

using Traits = gebp_traits<double, double>;
template <int Order>
using ReadMapper = const_blas_data_mapper<double, Index, Order>;
using WriteMapper = blas_data_mapper<double, Index, ColMajor, Unaligned, 1>;
BTFIELD_INSTANTIATE template struct gebp_kernel<double, double, Index, WriteMapper, Traits::mr, Traits::nr,
                                                false, false>;
BTFIELD_INSTANTIATE template struct gemm_pack_lhs<double, Index, ReadMapper<ColMajor>, Traits::mr,
                                                  Traits::LhsProgress, Traits::LhsPacket4Packing, ColMajor>;
BTFIELD_INSTANTIATE template struct gemm_pack_lhs<double, Index, ReadMapper<RowMajor>, Traits::mr,
                                                  Traits::LhsProgress, Traits::LhsPacket4Packing, RowMajor>;
BTFIELD_INSTANTIATE template struct gemm_pack_rhs<double, Index, ReadMapper<ColMajor>, Traits::nr, ColMajor>;
BTFIELD_INSTANTIATE template struct gemm_pack_rhs<double, Index, ReadMapper<RowMajor>, Traits::nr, RowMajor>;

#define BTFIELD_MATRIX_VECTOR_PRODUCT(LHS, RHS)                        \
    BTFIELD_INSTANTIATE template struct general_matrix_vector_product< \
        Index, double, ReadMapper<LHS>, LHS, false, double, ReadMapper<RHS>, false, 0>;
BTFIELD_MATRIX_VECTOR_PRODUCT(ColMajor, ColMajor)
BTFIELD_MATRIX_VECTOR_PRODUCT(ColMajor, RowMajor)
BTFIELD_MATRIX_VECTOR_PRODUCT(RowMajor, ColMajor)
BTFIELD_MATRIX_VECTOR_PRODUCT(RowMajor, RowMajor)
#undef BTFIELD_MATRIX_VECTOR_PRODUCT

#define BTFIELD_MATRIX_PRODUCT(LHS, RHS)                                                                 \
    BTFIELD_INSTANTIATE template struct general_matrix_matrix_product<Index, double, LHS, false, double, \
                                                                      RHS, false, ColMajor, 1>;
BTFIELD_MATRIX_PRODUCT(ColMajor, ColMajor)
BTFIELD_MATRIX_PRODUCT(ColMajor, RowMajor)
BTFIELD_MATRIX_PRODUCT(RowMajor, ColMajor)
BTFIELD_MATRIX_PRODUCT(RowMajor, RowMajor)
#undef BTFIELD_MATRIX_PRODUCT

#define BTFIELD_TRIANGULAR_SOLVE(MODE)                                                                 \
    BTFIELD_INSTANTIATE template struct triangular_solve_matrix<double, Index, OnTheLeft, MODE, false, \
                                                                ColMajor, ColMajor, 1>;
BTFIELD_TRIANGULAR_SOLVE(Lower)
BTFIELD_TRIANGULAR_SOLVE(Upper)
BTFIELD_TRIANGULAR_SOLVE(UnitLower)
#undef BTFIELD_TRIANGULAR_SOLVE

}  // namespace internal
}  // namespace Eigen
